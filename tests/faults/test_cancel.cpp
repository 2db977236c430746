// Builds that are cancelled, and builds that are repeated: memory is given back and the next build is right.

#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/pipeline/build_on.h>
#include <tests/amount.h>
#include <tests/faults/every_allocation.h>
#include <tests/oracle/meshes.h>
#include <tools/cli/build/build_names.h>

#include <tests/catch.h>

#include <algorithm>
#include <fstream>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

#if defined(HIPRT_QUICK_TESTS)
constexpr unsigned kCancels = 60;
#else
constexpr unsigned kCancels = trials(1000);
#endif

/// Bytes of the process in memory.
std::uint64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * 4096;
}

}  // namespace

TEST_CASE("builds cancelled at random calls of the callback stop there, leak nothing, and the next build is the same") {
  const oracle::Mesh mesh = oracle::star(3, kFaultSeed);
  const std::vector views{mesh.view()};
  oracle::Random random(kFaultSeed);
  for (const auto& [word, builder] : tools::kBuilders) {
    CAPTURE(word);
    const build::BuildOptions options{.builder = builder, .threads = 1, .reinsertion_rounds = 2};
    const build::SceneInput scene{views, {}};
    const auto expected = build::build(scene, options);
    REQUIRE(expected.has_value());
    unsigned calls = 0, stop = ~0u;
    const build::ProgressCallback callback = [&](const build::Progress&) { return ++calls < stop; };
    // Every chance to cancel is taken, not one in 20 ms.
    const auto cancelled = [&](unsigned at) {
      calls = 0;
      stop = at;
      build::Monitor monitor(callback, build::Monitor::Interval{0});
      build::MemoryLedger ledger;
      build::CpuEngine engine(monitor, ledger);
      try {
        return !build::Threads::run(1, [&] { return build::build_on(engine, scene, options); }).has_value();
      } catch (const build::Cancelled&) {
        return true;
      }
    };
    REQUIRE_FALSE(cancelled(~0u));
    const unsigned all = calls;
    REQUIRE(all > 10);
    REQUIRE(cancelled(all / 2));
    const std::int64_t before = live_allocations();
    bool stopped = true;
    for (unsigned i = 0; i < kCancels; ++i) {
      const unsigned at = 1 + random.below(all);
      stopped = stopped && cancelled(at) && calls == at;
    }
    CHECK(stopped);
    CHECK(live_allocations() == before);
    const auto again = build::build(scene, options);
    REQUIRE(again.has_value());
    CHECK(std::ranges::equal(again->buffer.bytes(), expected->buffer.bytes()));
  }
}

TEST_CASE("10,000 builds whose results are destroyed take no more memory than the first ones") {
  const oracle::Mesh mesh = oracle::icosphere(2);
  const std::vector views{mesh.view()};
  const auto build_once = [&](unsigned i) {
    const build::Builder builder = tools::kBuilders[i % std::size(tools::kBuilders)].second;
    const auto bvh = build::build(views, {.builder = builder, .threads = 1});
    return bvh.has_value() && bvh->statistics.leaves != 0;
  };
  bool good = true;
  for (unsigned i = 0; i < 200; ++i) good = build_once(i) && good;
  const std::uint64_t resident = resident_bytes();
  const std::int64_t live = live_allocations();
  for (unsigned i = 0; i < trials(10000); ++i) good = build_once(i) && good;
  CHECK(good);
  CHECK(live_allocations() == live);
  // Sanitizers keep freed memory.
#if !defined(HIPRT_CHECKS_SLOW)
  CHECK(resident_bytes() < resident + (std::uint64_t{4} << 20));
#endif
  static_cast<void>(resident);
}
