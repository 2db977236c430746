/// bvhbuild --refit end to end.

#include "programs.h"

#include <tests/catch.h>
#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// Two grids built into one file, and a moved one.
struct Files {
  TempFolder folder;
  std::string low = folder.write("low.obj", grid_obj(8)), high = folder.write("high.obj", grid_obj(2, 4)),
              moved = folder.write("moved.obj", grid_obj(8, 2)), bvh = folder / "s.bvh", out = folder / "out.bvh";

  Files() { check_good(run({kBvhBuild, low, high, "-o", bvh})); }
};

}  // namespace

TEST_CASE("Programs: bvhbuild --refit writes the tree of one file around moved meshes") {
  const Files f;
  const std::string before = read_file(f.bvh);
  const CommandResult text = run({kBvhBuild, f.bvh, "--refit", f.moved, "--refit", f.high, "-o", f.out});
  check_good(text);
  CHECK_THAT(text.out, Contains("SAH cost ") && Contains("times") && Contains("exchange slack ") &&
                           Contains("no rebuild needed"));
  CHECK(read_file(f.bvh) == before);
  check_good(run({kBvhInfo, "--validate", f.out}));
  const json info = json::parse(run({kBvhInfo, f.out, "--json"}).out);
  const json refit = json::parse(
      run({kBvhBuild, "--refit", f.moved, f.bvh, "--refit", f.high, "-o", f.out, "--threads", "1", "--json"}).out);
  CHECK(refit["bytes"] == before.size());
  CHECK(refit["layout"] == "planes");
  CHECK(refit["sah_cost"]["now"] == Approx(info["tree"]["sah_cost"].get<double>()));
  CHECK(refit["sah_cost"]["ratio"] > 0);
  CHECK(refit["exchange_slack"]["now"] == Approx(info["tree"]["exchange_slack"].get<double>()));
  CHECK(refit["rebuild_advised"] == false);
  CHECK(refit["seconds"]["refit"] > 0);
  // And back: the same bytes.
  check_good(run({kBvhBuild, f.out, "--refit", f.low, "--refit", f.high, "-o", f.folder / "back.bvh"}));
  CHECK(read_file(f.folder / "back.bvh") == before);
}

TEST_CASE("Programs: bvhbuild --refit fails on meshes that do not match, with status 1, and leaves no file") {
  const Files f;
  const auto fails = [&](const std::vector<std::string>& arguments, const std::string& word) {
    std::vector<std::string> command{kBvhBuild};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const CommandResult result = run(command);
    INFO(result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains(word));
    CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
    CHECK(f.folder.names() == std::vector<std::string>{"high.obj", "low.obj", "moved.obj", "s.bvh"});
  };
  fails({f.bvh, "--refit", f.moved, "-o", f.out}, "1 geometries, but the file to refit has 2");
  fails({f.bvh, "--refit", f.high, "--refit", f.moved, "-o", f.out},
        "mesh 0 (high.obj): 8 triangles, but the file to refit has 128");
  fails({f.low, "--refit", f.moved, "-o", f.out}, "low.obj: not a valid BVH file");
  fails({f.bvh, "--refit", f.bvh, "-o", f.out}, "s.bvh");
  fails({f.bvh, "--refit", f.moved, "--refit", f.high, "-o", f.bvh}, "one of the inputs");
  fails({f.bvh, "--refit", f.moved, "--refit", f.high, "-o", f.moved}, "one of the inputs");
  fails({f.bvh, "--refit", f.folder / "none.obj", "--refit", f.high, "-o", f.out}, "none.obj");
}

TEST_CASE("Programs: --refit excludes all options of a build") {
  const Files f;
  const auto misused = [&](const std::vector<std::string>& more, const std::string& word) {
    std::vector<std::string> command{kBvhBuild, f.bvh, "--refit", f.moved, "-o", f.out};
    command.insert(command.end(), more.begin(), more.end());
    const CommandResult result = run(command);
    INFO(result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(word));
  };
  misused({"--builder", "hq"}, "--builder");
  misused({"--quality", "high"}, "--quality");
  misused({"--import", "tree.json"}, "--import");
  misused({"--nodes", "half"}, "--nodes");
  misused({"--no-pairs"}, "--no-pairs");
  misused({"--max-leaf", "2"}, "--max-leaf");
  misused({f.low}, "one INPUT");
}
