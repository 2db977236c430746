// bvhbuild --manifest under mpirun, with ranks that are killed.

#include "farm_inputs.h"
#include "launched.h"

#include <tests/catch.h>
#include <tests/oracle/random.h>

#include <cstdio>
#include <thread>

using namespace hiprt;
using namespace hiprt::test;

TEST_CASE("ranks under mpirun: results larger than a piece arrive whole, on 1 to 5 ranks") {
  require_mpirun();
  for (const int ranks : {1, 2, 3, 5}) {
    CAPTURE(ranks);
    const CommandResult result = run(mpirun(ranks, {HIPRT_DEAL_PROGRAM, "12", "1000", "20000000"}));
    INFO(result.err);
    CHECK(result.status == 0);
    CHECK(result.out == "sum 506 units 12 damaged 0 lost 0 not_done 0\n");
  }
}

TEST_CASE("ranks under mpirun: a wrong command line and a failed run have one message and a status that is not 0") {
  require_mpirun();
  const TempFolder folder;
  const CommandResult usage = run(mpirun(3, {kBvhBuild, "--frobnicate"}));
  CHECK(usage.status == 2);
  CHECK_THAT(usage.err, Catch::Contains("--frobnicate"));
  CHECK(usage.err.find("bvhbuild:") == usage.err.rfind("bvhbuild: "));
  for (const bool recovery : {false, true}) {
    const CommandResult failed = run(mpirun(2, farm((folder / "none.json").string(), folder / "c"), recovery));
    INFO(failed.err);
    CHECK(failed.status == 1);
    CHECK_THAT(failed.err, Catch::Contains("none.json"));
  }
}

TEST_CASE("farm: 1, 2, 3 and 5 ranks make the files of one process, byte for byte") {
  require_mpirun();
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  for (const int ranks : {1, 2, 3, 5}) {
    CAPTURE(ranks);
    const fs::path cache = folder / ("ranks" + std::to_string(ranks));
    const auto report = json_of(run(mpirun(ranks, farm(manifest, cache, {"--json"}))));
    CHECK(report["ranks"] == ranks);
    CHECK(report["misses"] == kSizes.size());
    CHECK(content_of(cache) == expected);
  }
}

TEST_CASE("farm: a rank killed at a random moment loses nothing, or the next run completes the cache") {
  require_mpirun();
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
    const int ranks = 2 + static_cast<int>(random.below(2));
    const int victim = 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(ranks - 1)));
    const bool lossy = random.below(4) != 0;
    const auto delay = std::chrono::milliseconds(random.below(700));
    CAPTURE(kSeed, i, ranks, victim, lossy, delay.count());
    const fs::path cache = folder / ("kill" + std::to_string(i));
    const Marked marked;
    Command command(mpirun(
        ranks, farm(manifest, cache, lossy ? std::vector<std::string>{"--lossy-ranks"} : std::vector<std::string>{}),
        /*recovery=*/true));
    for (int step = 0; step < 400 && !marked.ranks().contains(victim); ++step) ::usleep(5000);
    std::this_thread::sleep_for(delay);
    const auto living = marked.ranks();
    if (const auto found = living.find(victim); found != living.end() && ::kill(found->second, SIGKILL) == 0) ++killed;
    REQUIRE(command.ends_within(std::chrono::seconds(90)));
    const CommandResult result = command.finish();
    INFO(result.err);
    CHECK(marked.ranks().empty());
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
