/// bvhinfo --export and bvhbuild --import, as a user calls them.

#include "programs.h"

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <algorithm>

using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// Status, one line that has the word, and nothing new in the folder.
void check_failure(const TempFolder& folder, int status, const std::vector<std::string>& arguments,
                   const std::string& word) {
  const auto names = folder.names();
  const CommandResult result = run(arguments);
  INFO(result.err);
  CHECK(result.status == status);
  CHECK_THAT(result.err, Contains(word));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
  CHECK(folder.names() == names);
}

json info(const std::string& path) { return json::parse(run({kBvhInfo, path, "--json"}).out); }

}  // namespace

TEST_CASE("Exchange programs: a tree is exported and imported again") {
  const TempFolder folder;
  const std::string low = folder.write("low.obj", grid_obj(16)), high = folder.write("high.obj", grid_obj(4, 2));
  const std::string before = folder / "a.bvh", tree = folder / "tree.json", after = folder / "b.bvh";
  check_quiet(run({kBvhBuild, low, high, "-o", before, "--builder", "hploc", "--nodes", "half"}));
  check_quiet(run({kBvhInfo, before, "--export", tree}));
  check_quiet(run({kBvhBuild, low, high, "-o", after, "--import", tree, "--reinsertion-rounds", "1"}));
  CHECK(run({kBvhInfo, after, "--validate"}).status == 0);
  const json there = info(after);
  CHECK(there["provenance"]["builder"] == "imported");
  CHECK(there["provenance"]["statistics"]["builder"] == "imported");
  CHECK(there["tree"]["leaf_triangles"] == 544);
  CHECK(there["tree"]["sah_cost"] <= info(before)["tree"]["sah_cost"]);
  const CommandResult json_result = run({kBvhBuild, low, high, "-o", after, "--import", tree, "--json"});
  CHECK(json_result.err.empty());
  CHECK(json::parse(json_result.out)["builder"] == "imported");
  const CommandResult exported = run({kBvhInfo, before, "--export", tree, "--json"});
  const json counts = json::parse(exported.out);
  CHECK(counts["primitives"] == 544);
  CHECK(counts["nodes"] == json::parse(read_file(tree))["nodes"].size());
}

TEST_CASE("Exchange programs: a tree written by hand") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(1)), bvh = folder / "a.bvh";
  const std::string tree = folder.write("tree.json", R"({"format": "hiprt exchange bvh", "version": 1,
      "nodes": [{"min": [0, 0, 0], "max": [1, 1, 0], "primitives": [0, 2]}], "primitives": [1, 0]})");
  check_quiet(run({kBvhBuild, mesh, "-o", bvh, "--import", tree}));
  const json there = info(bvh);
  CHECK(there["tree"]["leaves"] == 1);
  CHECK(there["tree"]["leaf_triangles"] == 2);
}

TEST_CASE("Exchange programs: bad usage is status 2; bad trees are status 1 and leave no file") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(2)), other = folder.write("b.obj", grid_obj(1));
  const std::string bvh = folder / "a.bvh", tree = folder / "tree.json", out = folder / "out.bvh";
  check_quiet(run({kBvhBuild, mesh, "-o", bvh}));
  check_quiet(run({kBvhInfo, bvh, "--export", tree}));
  check_failure(folder, 2, {kBvhBuild, mesh, "-o", out, "--import", tree, "--builder", "sah"}, "--import");
  check_failure(folder, 2, {kBvhBuild, mesh, "-o", out, "--import", tree, "--quality", "high"}, "--import");
  check_failure(folder, 2, {kBvhBuild, mesh, "-o", out, "--builder", "imported"}, "imported");
  check_failure(folder, 2, {kBvhInfo, bvh, "--export", tree, "--dump"}, "--dump");
  check_failure(folder, 1, {kBvhBuild, other, "-o", out, "--import", tree}, "tree.json: node ");
  check_failure(folder, 1, {kBvhBuild, mesh, "-o", out, "--import", folder / "none.json"}, "none.json");
  check_failure(folder, 1, {kBvhBuild, mesh, "-o", out, "--import", mesh}, "a.obj: parse error at line 1");
  const std::string text = read_file(tree);
  check_failure(folder, 1, {kBvhBuild, mesh, "-o", tree, "--import", tree}, "one of the inputs");
  CHECK(read_file(tree) == text);
  const std::string file = read_file(bvh);
  check_failure(folder, 1, {kBvhInfo, bvh, "--export", bvh}, "one of the inputs");
  CHECK(read_file(bvh) == file);
  check_failure(folder, 1, {kBvhInfo, bvh, "--export", folder / "no/tree.json"}, "there is no folder");
  std::string damaged = file;
  damaged[file.size() / 2] = static_cast<char>(damaged[file.size() / 2] ^ 1);
  check_failure(folder, 1, {kBvhInfo, folder.write("bad.bvh", damaged), "--export", folder / "t.json"}, "BadChecksum");
}
