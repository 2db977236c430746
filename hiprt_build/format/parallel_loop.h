#pragma once
/// A loop that the caller provides, so that its own threads do the work.

#include <cstddef>
#include <functional>

namespace hiprt {

/// Calls body(i) for every i below a count, in any order, on one thread or many.
using ParallelLoop = std::function<void(std::size_t count, const std::function<void(std::size_t i)>& body)>;

/// Calls body(i) for every i below @p count: with @p loop, or on this thread if there is no loop.
template <class Body> void run_loop(const ParallelLoop& loop, std::size_t count, const Body& body) {
  if (loop) return loop(count, body);
  for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace hiprt
