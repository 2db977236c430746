// bvhbuild --manifest under mpirun, with ranks that are killed.

#include "farm_inputs.h"

#include <tests/catch.h>
#include <tests/oracle/random.h>
#include <tests/tools/mpi_run.h>

#include <cstdio>
#include <thread>

using namespace hiprt;
using namespace hiprt::test;

namespace {

const std::string& mpirun() {
  static const std::string path = find_mpirun(kBvhBuild);
  return path;
}

/// Under mpirun, to its end. @param recovery whether the end of a rank does not end the run.
CommandResult run_ranks(unsigned ranks, const Words& program, bool recovery = false) {
  return run_bounded(under_mpirun(mpirun(), ranks, program, recovery ? with_recovery() : Words{}));
}

}  // namespace

TEST_CASE("ranks under mpirun: results larger than a piece arrive whole, on 1 to 5 ranks") {
  if (skip_without(mpirun(), "bvhbuild under mpirun")) return;
  for (const unsigned ranks : {1u, 2u, 3u, 5u}) {
    CAPTURE(ranks);
    const CommandResult result = run_ranks(ranks, {HIPRT_DEAL_PROGRAM, "12", "1000", "20000000"});
    INFO(result.err);
    CHECK(result.status == 0);
    CHECK(result.out == "sum 506 units 12 damaged 0 lost 0 not_done 0\n");
  }
}

TEST_CASE("ranks under mpirun: a wrong command line and a failed run have one message and a status that is not 0") {
  if (skip_without(mpirun(), "bvhbuild under mpirun")) return;
  const TempFolder folder;
  const CommandResult usage = run_ranks(3, {kBvhBuild, "--frobnicate"});
  CHECK(usage.status == 2);
  CHECK_THAT(usage.err, Catch::Contains("--frobnicate"));
  CHECK(usage.err.find("bvhbuild:") == usage.err.rfind("bvhbuild: "));
  for (const bool recovery : {false, true}) {
    const CommandResult failed = run_ranks(2, farm((folder / "none.json").string(), folder / "c"), recovery);
    INFO(failed.err);
    CHECK(failed.status == 1);
    CHECK_THAT(failed.err, Catch::Contains("none.json"));
  }
}

TEST_CASE("farm: 1, 2, 3 and 5 ranks make the files of one process, byte for byte") {
  if (skip_without(mpirun(), "bvhbuild under mpirun")) return;
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  for (const unsigned ranks : {1u, 2u, 3u, 5u}) {
    CAPTURE(ranks);
    const fs::path cache = folder / ("ranks" + std::to_string(ranks));
    const auto report = json_of(run_ranks(ranks, farm(manifest, cache, {"--json"})));
    CHECK(report["ranks"] == ranks);
    CHECK(report["misses"] == kSizes.size());
    CHECK(content_of(cache) == expected);
  }
}

TEST_CASE("farm: a rank killed at a random moment loses nothing, or the next run completes the cache") {
  if (skip_without(mpirun(), "bvhbuild under mpirun")) return;
  constexpr std::uint64_t kSeed = 43;
  oracle::Random random(kSeed);
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  unsigned killed = 0, complete = 0;
#ifdef HIPRT_QUICK_TESTS
  const unsigned runs = 4;
#else
  const unsigned runs = 100;
#endif
  for (unsigned i = 0; i < runs; ++i) {
    const unsigned ranks = 2 + random.below(2), victim = 1 + random.below(ranks - 1);
    const bool lossy = random.below(4) != 0;
    const auto delay = std::chrono::milliseconds(random.below(700));
    CAPTURE(kSeed, i, ranks, victim, lossy, delay.count());
    const fs::path cache = folder / ("kill" + std::to_string(i));
    MpiRun one(under_mpirun(mpirun(), ranks, farm(manifest, cache, lossy ? Words{"--lossy-ranks"} : Words{}),
                            with_recovery()));
    if (const pid_t process = one.wait_for(static_cast<int>(victim)); process > 0) {
      std::this_thread::sleep_for(delay);
      const auto living = one.processes(static_cast<int>(victim));
      if (!living.empty() && ::kill(process, SIGKILL) == 0) ++killed;
    }
    const CommandResult result = run_bounded(one, std::chrono::seconds(90));
    INFO(result.err);
    if (result.status == 0) {
      ++complete;
      // A rank that is killed after its last asset leaves its file of use, which the next run removes.
      auto content = content_of(cache);
      std::erase_if(content, [](const auto& file) { return file.first.starts_with(".use-") && file.second.empty(); });
      CHECK(content == expected);
    } else {
      CHECK(result.status == 1);
    }
    check_quiet(run(farm(manifest, cache)));
    CHECK(content_of(cache) == expected);
    fs::remove_all(cache);
  }
  std::printf("seed %llu: %u runs, %u ranks killed, %u runs complete\n", static_cast<unsigned long long>(kSeed), runs,
              killed, complete);
}
