// After a callback has said no: every thread stops, at its next report of work.

#include <hiprt_build/exec/cpu.h>

#include <tests/catch.h>

#include <atomic>
#include <thread>

using namespace hiprt::build;

TEST_CASE("a cancel reaches threads that do not call the callback", "[cancel]") {
  unsigned calls = 0;
  const ProgressCallback callback = [&](const Progress&) { return ++calls < 2; };
  Monitor monitor(callback, std::chrono::hours(1));
  monitor.start("first", 0.5, 100);
  CHECK_NOTHROW(monitor.add(1));
  CHECK(calls == 1);
  CHECK_THROWS_AS(monitor.start("second", 1.0, 100), Cancelled);
  // The next call would be due in an hour: nobody asks again, and everybody knows.
  CHECK_THROWS_AS(monitor.check(), Cancelled);
  CHECK_THROWS_AS(monitor.add(1), Cancelled);
  bool thrown = false;
  std::thread([&] {
    try {
      monitor.add(1);
    } catch (const Cancelled&) {
      thrown = true;
    }
  }).join();
  CHECK(thrown);
  CHECK(calls == 2);
}

TEST_CASE("a loop ends after a cancel, without the rest of its work", "[cancel]") {
  std::atomic<unsigned> calls{0}, done{0};
  const ProgressCallback callback = [&](const Progress&) { return calls.fetch_add(1) < 2; };
  Monitor monitor(callback, std::chrono::nanoseconds(0));
  MemoryLedger ledger;
  CpuEngine engine(monitor, ledger);
  monitor.start("loop", 1.0, 1u << 20);
  constexpr std::size_t kWork = 1u << 20;
  CHECK_THROWS_AS(engine.for_each(kWork,
                                  [&](std::size_t) {
                                    engine.monitor().add(1);
                                    done.fetch_add(1);
                                  }),
                  Cancelled);
  // One call was for the start, one said yes; what other threads had begun may still be counted.
  CHECK(calls == 3);
  CHECK(done < 4096);
}
