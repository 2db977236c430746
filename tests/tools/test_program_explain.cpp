/// bvhtrace --explain as a user runs it.

#include "json_result.h"
#include "programs.h"

#include <tools/scene_io/rays_file.h>

#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// Rays down onto a grid of 8 x 8 squares at z = 0: 0 hits, 1 misses, 2 starts below it, 3 is any's.
struct Files {
  TempFolder folder;
  std::string bvh = folder / "g.bvh", rays = folder / "g.rays";

  explicit Files(bool instanced = false) {
    folder.write("grid.obj", grid_obj(8));
    if (instanced) {
      const json scene{
          {"format", "hiprt scene"},
          {"version", 1},
          {"objects", {{"grid", {"grid.obj"}}}},
          {"groups",
           {{"pair", {{{"object", "grid"}, {"id", 70}}, {{"object", "grid"}, {"id", 71}, {"translate", {0, 0, -1}}}}},
            {"top", {{{"object", "pair"}, {"id", 5}}, {{"object", "grid"}, {"mask", 2}, {"translate", {0, 0, 1}}}}}}},
          {"scene", "top"}};
      folder.write("s.json", scene.dump());
    }
    check_good(run({kBvhBuild, folder / (instanced ? "s.json" : "grid.obj"), "-o", bvh}));
    const std::vector<Ray> all{{.origin = {2.25f, 3.5f, 5}, .direction = {0, 0, -1}},
                               {.origin = {20, 3.5f, 5}, .direction = {0, 0, -1}},
                               {.origin = {2.25f, 3.5f, -5}, .direction = {0, 0, -1}}};
    REQUIRE(tools::write_rays(rays, false, all).has_value());
  }
  json explain(const std::string& ray, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command{kBvhTrace, bvh, "--rays", rays, "--explain", ray, "--json"};
    command.insert(command.end(), more.begin(), more.end());
    return json_of(run(command));
  }
  std::string text(const std::string& ray) const {
    const CommandResult result = run({kBvhTrace, bvh, "--rays", rays, "--explain", ray});
    check_good(result);
    return result.out;
  }
};

}  // namespace

TEST_CASE("bvhtrace --explain: the steps lead from the root to the hit, and their number equals the counters") {
  const Files files;
  for (const std::string triangle_test : {"watertight", "fast", "reference"})
    for (const std::string box_test : {"conservative", "plain"}) {
      if (triangle_test == "reference" && box_test == "plain") continue;
      const json told = files.explain("0", {"--triangle-test", triangle_test, "--box-test", box_test});
      const json& steps = told["steps"];
      CHECK(steps[0]["node"] == 0);
      CHECK(steps[0]["level"] == 0);
      std::size_t nodes = 0, leaves = 0;
      std::string last_verdict;
      unsigned nearest = 0;
      for (const json& step : steps) {
        if (step.contains("children")) {
          ++nodes;
          for (const json& child : step["children"]) CHECK((child.contains("t") != child.contains("missed")));
        }
        if (!step.contains("primitives")) continue;
        ++leaves;
        for (const json& primitive : step["primitives"])
          if (primitive["verdict"] == "closest so far") {
            ++nearest;
            CHECK(primitive["t"] == 5.0);
            CHECK(primitive["primitive"] == told["hit"]["primitive"]);
          }
      }
      CHECK(nearest >= 1);
      CHECK(told["work"]["nodes"] == nodes);
      CHECK(told["work"]["leaves"] == leaves);
      CHECK(told["hit"]["t"] == 5.0);
      CHECK(told["path"].empty());
    }
}

TEST_CASE("bvhtrace --explain: misses, and rays that start behind everything") {
  const Files files;
  const json beside = files.explain("1"), behind = files.explain("2");
  CHECK(beside["hit"].is_null());
  CHECK(beside["steps"].size() == 1);
  CHECK(behind["hit"].is_null());
  CHECK(beside["work"]["unvisited"] == 0);
  CHECK_THAT(files.text("1"), Contains("no child met; misses ") && Contains("no hit\n"));
}

TEST_CASE("bvhtrace --explain: the path through instances and groups, and instances that a mask hides") {
  const Files files(true);
  const json told = files.explain("0");
  CHECK(told["hit"]["t"] == 4.0);  // The ray's file has no masks: it sees all.
  std::vector<json> entered, left;
  std::size_t level = 0;
  for (const json& step : told["steps"]) {
    if (step.contains("left")) {
      left.push_back(step);
      --level;
    }
    CHECK(step["level"] == level);
    if (step.contains("at")) {
      entered.push_back(step);
      ++level;
    }
  }
  REQUIRE(entered.size() >= 1);
  CHECK(left.size() == entered.size());
  CHECK(entered[0]["instance"] == 1);
  CHECK(told["path"] == json{1});
  CHECK(told["work"]["instances"] >= entered.size());
  const std::string text = files.text("0");
  CHECK_THAT(text,
             Contains(" entered at node 0\n") && Contains("out of instance 1\n") && Contains(" in instance 1, t = 4"));
}

TEST_CASE("bvhtrace --explain: any hit ends with the first one") {
  const Files files;
  const json told = files.explain("0", {"--query", "any"});
  CHECK(told["hit"]["t"] == 5.0);
  CHECK(told["steps"].back().contains("primitives"));
}

TEST_CASE("bvhtrace --explain: missing rays and options of traces are refused") {
  const Files files;
  const std::vector<std::string> command{kBvhTrace, files.bvh, "--rays", files.rays};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), command.begin(), command.end());
    return run(more);
  };
  const CommandResult missing = with({"--explain", "3"});
  CHECK(missing.status == 1);
  CHECK_THAT(missing.err, Contains("has 3 rays, numbered from 0: there is no ray 3"));
  CHECK(with({"--explain", "-1"}).status == 2);
  CHECK(with({"--explain", "0", "--hits", files.folder / "h"}).status == 2);
  CHECK(with({"--explain", "0", "--repeat", "2"}).status == 2);
  const CommandResult gpu = with({"--explain", "0", "--device", "gpu"});
  CHECK(gpu.status == 2);
  CHECK_THAT(gpu.err, Contains("traces the ray on the CPU"));
  const CommandResult neither = with({});
  CHECK(neither.status == 2);
  CHECK_THAT(neither.err, Contains("--hits (or --explain)"));
}
