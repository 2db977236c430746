#pragma once
/// threads.h by std::thread. Internal.
///
/// A loop starts the free threads of its crew, and ends them when it ends. oneTBB keeps its threads, so its short loops
/// are faster.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace hiprt::build {

namespace std_threads_detail {

/// The threads that nested loops share.
class Crew {
 public:
  explicit Crew(unsigned threads) : free_(static_cast<int>(threads) - 1) {}

  bool take() {
    int free = free_.load(std::memory_order_relaxed);
    while (free > 0)
      if (free_.compare_exchange_weak(free, free - 1, std::memory_order_relaxed)) return true;
    return false;
  }
  void give_back() { free_.fetch_add(1, std::memory_order_relaxed); }

 private:
  std::atomic<int> free_;
};

/// The crew of this thread's loops; none: loops run alone.
inline thread_local Crew* crew = nullptr;

/// Keeps the first exception.
class Failure {
 public:
  template <class Body> void guard(const Body& body) noexcept {
    try {
      body();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!exception_) exception_ = std::current_exception();
      failed_.store(true, std::memory_order_relaxed);
    }
  }
  bool failed() const { return failed_.load(std::memory_order_relaxed); }
  void pass_on() const {
    if (exception_) std::rethrow_exception(exception_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr exception_;
  std::atomic<bool> failed_ = false;
};

/// Threads of a crew, which end with this.
class Helpers {
 public:
  Helpers() = default;
  Helpers(const Helpers&) = delete;
  Helpers& operator=(const Helpers&) = delete;
  ~Helpers() { join(); }

  /// @return whether a thread was free and runs body().
  template <class Body> bool start(const Body& body) {
    Crew* shared = crew;
    if (shared == nullptr || !shared->take()) return false;
    try {
      threads_.emplace_back([shared, body] {
        crew = shared;
        body();
        shared->give_back();
      });
    } catch (const std::system_error&) {
      // The machine has no thread left: this one does the work.
      shared->give_back();
      return false;
    } catch (...) {
      shared->give_back();
      throw;
    }
    return true;
  }
  void join() {
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  std::vector<std::thread> threads_;
};

/// What StdThreads::Limit asks for; 0: as many threads as the machine has.
inline std::atomic<unsigned> limit{0};

}  // namespace std_threads_detail

struct StdThreads {
  static unsigned count() {
    const unsigned asked = std_threads_detail::limit.load();
    return asked != 0 ? asked : std::max(1u, std::thread::hardware_concurrency());
  }

  template <class Body> static auto run(unsigned threads, const Body& body) {
    std_threads_detail::Crew crew(threads == 0 ? count() : std::min(threads, count()));
    struct Restore {
      std_threads_detail::Crew* before = std_threads_detail::crew;
      ~Restore() { std_threads_detail::crew = before; }
    } restore;
    std_threads_detail::crew = &crew;
    return body();
  }

  template <class Body> static void for_each(std::size_t n, const Body& body) {
    std::atomic<std::size_t> next{0};
    std_threads_detail::Failure failure;
    const auto work = [&] {
      failure.guard([&] {
        for (std::size_t i; !failure.failed() && (i = next.fetch_add(1, std::memory_order_relaxed)) < n;) body(i);
      });
    };
    {
      std_threads_detail::Helpers helpers;
      for (std::size_t more = 1; more < n && helpers.start(work); ++more) {
      }
      work();
    }
    failure.pass_on();
  }

  template <class First, class Second> static void invoke(const First& first, const Second& second) {
    std_threads_detail::Failure failure;
    {
      std_threads_detail::Helpers helpers;
      const bool started = helpers.start([&] { failure.guard(second); });
      failure.guard(first);
      if (!started && !failure.failed()) failure.guard(second);
    }
    failure.pass_on();
  }

  template <class T, class Sum, class Combine>
  static T reduce(std::size_t n, std::size_t chunk, const T& none, const Sum& sum, const Combine& combine) {
    const std::size_t parts = (n + chunk - 1) / chunk;
    std::vector<std::optional<T>> results(parts);
    for_each(parts, [&](std::size_t part) {
      results[part].emplace(sum(part * chunk, std::min(n, (part + 1) * chunk), none));
    });
    T total = none;
    for (const std::optional<T>& result : results) total = combine(total, *result);
    return total;
  }

  /// While it lives, loops may use this many threads.
  class Limit {
   public:
    /// @param threads 0: as many as the machine has.
    explicit Limit(unsigned threads) : before_(std_threads_detail::limit.exchange(threads)) {}
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;
    ~Limit() { std_threads_detail::limit.store(before_); }

   private:
    unsigned before_;
  };
};

}  // namespace hiprt::build
