/// What bvhquery refuses, and what a failure or an interruption leaves behind.

#include "query_runs.h"

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

void check_usage(std::vector<std::string> words, const std::string& wanted) {
  words.insert(words.begin(), {kBvhQuery, "a.bvh", "-o", "out"});
  const CommandResult result = run(words);
  INFO(result.err);
  CHECK(result.status == 2);
  CHECK_THAT(result.err, Catch::StartsWith("bvhquery: ") && Contains(wanted) && Contains("--help"));
}

}  // namespace

TEST_CASE("bvhquery: wrong command lines are named") {
  check_usage({}, "--points, --spheres, --boxes or --slice");
  check_usage({"--points", "p", "--boxes", "b"}, "excludes");
  check_usage({"--points", "p", "--query", "farthest"}, "farthest");
  check_usage({"--points", "p", "--query", "overlaps"}, "--query overlaps does not go with points");
  check_usage({"--boxes", "b", "--query", "closest"}, "use overlaps or any-overlap");
  check_usage({"--spheres", "s", "--query", "inside"}, "--query inside does not go with spheres");
  check_usage({"--points", "p", "--query", "within"}, "--query within needs --max-distance");
  check_usage({"--points", "p", "-k", "0", "--query", "nearest"}, "--nearest");
  check_usage({"--points", "p", "-k", "2"}, "--nearest goes with --query nearest");
  check_usage({"--points", "p", "--max-distance", "-1"}, "not a distance of 0 or more");
  check_usage({"--points", "p", "--max-distance", "nan"}, "not a distance of 0 or more");
  check_usage({"--spheres", "s", "--max-distance", "1"}, "spheres have their radius");
  check_usage({"--points", "p", "--query", "inside", "--paths", "x"}, "--paths does not go with --query inside");
  check_usage({"--points", "p", "--size", "8x8"}, "--size goes with --slice");
  check_usage({"--points", "p", "--sign", "winding"}, "--sign goes with --query signed or inside");
  check_usage({"--slice", "w"}, "not an axis");
  check_usage({"--slice", "z=inf"}, "not an axis");
  check_usage({"--slice", "z"}, "'out' ends neither in .exr nor in .png");
  check_usage({"--slice", "z", "--query", "nearest"}, "--slice goes with --query signed or closest");
  check_usage({"--slice", "z", "--paths", "x"}, "--slice does not go with --paths");
}

TEST_CASE("bvhquery: bad files are failures that name the file and leave nothing behind") {
  const TempFolder folder;
  const std::string obj = folder.write("a.obj", grid_obj(2)), bvh = folder / "a.bvh";
  check_quiet(run({kBvhBuild, obj, "-o", bvh}));
  const std::string atoms = folder.write("s.xyzr", "0 0 0 1\n"), spheres = folder / "s.bvh";
  check_quiet(run({kBvhBuild, atoms, "-o", spheres}));
  QueryRuns runs(folder, bvh);
  runs.points({0, 0, 0});
  const std::string points = folder / "in.queries", out = folder / "out.results";
  const std::vector<std::string> names{"a.bvh", "a.obj", "in.queries", "s.bvh", "s.xyzr"};
  const auto refuse = [&](const std::vector<std::string>& words, const std::string& wanted) {
    std::vector<std::string> all{kBvhQuery};
    all.insert(all.end(), words.begin(), words.end());
    check_failure(folder, all, wanted, names);
  };
  refuse({bvh, "--boxes", points, "-o", out}, "in.queries: the number at byte 4 is 3 (points)");
  refuse({bvh, "--points", folder / "none", "-o", out}, "none");
  refuse({obj, "--points", points, "-o", out}, "a.obj: not a valid BVH file");
  for (const char* query : {"signed", "inside"})
    refuse({spheres, "--points", points, "-o", out, "--query", query},
           "s.bvh: has custom primitives, spheres or curves");
  refuse({spheres, "--boxes", points, "-o", out}, "overlaps are those of triangles only");
  refuse({spheres, "--slice", "z", "-o", folder / "a.png"}, "Use --query closest, nearest or within");
  refuse({bvh, "--points", points, "-o", points}, "in.queries");
  refuse({bvh, "--points", points, "-o", folder / "no/such"}, "no/such");
  refuse({bvh, "--points", points, "-o", out, "--paths", out}, "--output and --paths are one file");
  refuse({bvh, "--slice", "z", "-o", folder / "no/such.png"}, "no/such.png");
}

TEST_CASE("bvhquery: Ctrl-C ends it, and the old results stay") {
  const TempFolder folder;
  const std::string bvh = folder / "a.bvh", out = folder.write("out.results", "old");
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(60)), "-o", bvh}));
  QueryRuns runs(folder, bvh);
  // Each sphere has all 7200 triangles: all of them would take minutes.
  std::vector<float> spheres;
  for (unsigned i = 0; i < 100'000; ++i) spheres.insert(spheres.end(), {30.0f, 30.0f, 0.0f, 1000.0f});
  runs.spheres(spheres);
  Command command(runs.command({"--query", "within"}));
  REQUIRE_FALSE(command.ends_within(std::chrono::milliseconds(400)));
  command.signal(SIGINT);
  const CommandResult result = command.finish();
  CHECK(result.status == 1);
  CHECK(result.err == "bvhquery: cancelled\n");
  CHECK(read_file(out) == "old");
  CHECK(folder.names() == std::vector<std::string>{"a.bvh", "a.obj", "in.queries", "out.results"});
}
