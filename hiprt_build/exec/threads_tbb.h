#pragma once
/// threads.h by oneTBB. Internal.

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>

namespace hiprt::build {

struct TbbThreads {
  /// A tbb::global_control of the program may lower it.
  static unsigned count() {
    return static_cast<unsigned>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  }

  template <class Body> static auto run(unsigned threads, const Body& body) {
    // More than the process may use would bring nothing but oneTBB's warning.
    tbb::task_arena arena(static_cast<int>(threads == 0 ? count() : std::min(threads, count())));
    return arena.execute(body);
  }

  template <class Body> static void for_each(std::size_t n, const Body& body) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, n, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) body(i);
        },
        tbb::simple_partitioner{});
  }

  template <class First, class Second> static void invoke(const First& first, const Second& second) {
    tbb::parallel_invoke(first, second);
  }

  template <class T, class Sum, class Combine>
  static T reduce(std::size_t n, std::size_t chunk, const T& none, const Sum& sum, const Combine& combine) {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, n, chunk), none,
        [&](const tbb::blocked_range<std::size_t>& range, const T& so_far) {
          return sum(range.begin(), range.end(), so_far);
        },
        combine);
  }

  /// While it lives, loops may use this many threads, also more than the machine has, which oneTBB alone does not
  /// allow.
  class Limit {
   public:
    /// @param threads 0: as many as the machine has.
    explicit Limit(unsigned threads)
        : control_(tbb::global_control::max_allowed_parallelism,
                   threads == 0 ? static_cast<unsigned>(tbb::info::default_concurrency()) : threads) {}

   private:
    tbb::global_control control_;
  };
};

}  // namespace hiprt::build
