#pragma once
/// The execution contract on the CPU: a step is a struct of spans with operator()(i), run for every i.
/// Work is divided by count, never by thread, so that results do not depend on how many threads there are. Internal.

#include <hiprt_build/exec/monitor.h>
#include <hiprt_build/exec/scratch.h>
#include <hiprt_build/exec/threads.h>

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace hiprt::build {

class CpuEngine {
 public:
  static constexpr std::size_t kChunk = 8192;

  CpuEngine(Monitor& monitor, MemoryLedger& ledger) : monitor_(monitor), ledger_(ledger) {}

  Monitor& monitor() { return monitor_; }
  MemoryLedger& ledger() { return ledger_; }

  template <class T> ScratchArray<T> allocate(std::size_t size) { return ScratchArray<T>(ledger_, size); }

  /// step(i) for i in [0, n), in any order. Reports n units of progress. A step that takes long says so by
  /// static constexpr std::size_t kChunk, how many of them take about a millisecond.
  template <class Step> void for_each(std::size_t n, const Step& step) {
    std::size_t chunk = kChunk;
    if constexpr (requires { Step::kChunk; }) chunk = Step::kChunk;
    Threads::for_each((n + chunk - 1) / chunk, [&](std::size_t c) {
      const std::size_t begin = c * chunk, end = std::min(n, begin + chunk);
      for (std::size_t i = begin; i < end; ++i) step(i);
      monitor_.add(end - begin);
    });
  }

  /// @return the smallest i below n for which test(i), or n. Reports n units of progress.
  template <class Test> std::size_t find_first(std::size_t n, const Test& test) {
    std::atomic<std::size_t> first{n};
    for_each(n, [&](std::size_t i) {
      if (!test(i)) return;
      std::size_t there = first.load(std::memory_order_relaxed);
      while (i < there && !first.compare_exchange_weak(there, i, std::memory_order_relaxed)) {
      }
    });
    return first.load();
  }

  /// body(chunk, begin, end) for the chunks of [0, n): chunk c is [c * kChunk, ...).
  template <class Body> void for_chunks(std::size_t n, const Body& body) {
    Threads::for_each(chunk_count(n), [&](std::size_t c) {
      const std::size_t begin = c * kChunk, end = std::min(n, begin + kChunk);
      body(c, begin, end);
      monitor_.add(end - begin);
    });
  }
  static std::size_t chunk_count(std::size_t n) { return (n + kChunk - 1) / kChunk; }

  /// body(chunk, begin, end) as for_chunks(), of work that is no progress: it only asks whether to go on.
  template <class Body> void for_quiet_chunks(std::size_t n, const Body& body, std::size_t chunk_size = kChunk) {
    Threads::for_each((n + chunk_size - 1) / chunk_size, [&](std::size_t c) {
      monitor_.check();
      body(c, c * chunk_size, std::min(n, (c + 1) * chunk_size));
    });
  }

  template <class T> void fill(std::span<T> values, const T& value) {
    for_quiet_chunks(values.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
      std::fill_n(values.data() + begin, end - begin, value);
    });
  }

  /// @pre to.size() >= from.size(), and they share nothing.
  template <class T> void copy(std::span<const T> from, std::span<T> to) {
    for_quiet_chunks(from.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
      std::copy_n(from.data() + begin, end - begin, to.data() + begin);
    });
  }

  /// Runs both, at the same time if there is a thread free.
  template <class First, class Second> void invoke(const First& first, const Second& second) {
    Threads::invoke(first, second);
  }

  /// Replaces each value by the sum of those before it. @return the sum of all.
  template <class T> T exclusive_scan(std::span<T> values) {
    T sum = 0;
    for (std::size_t begin = 0; begin < values.size(); begin += kChunk) {
      monitor_.check();
      for (T& value : values.subspan(begin, std::min(kChunk, values.size() - begin))) sum += std::exchange(value, sum);
    }
    return sum;
  }

 private:
  Monitor& monitor_;
  MemoryLedger& ledger_;
};

}  // namespace hiprt::build
