/// Scenes that move through bvhbuild, bvhinfo, bvhtrace and bvhrender.

#include "json_result.h"
#include "programs.h"

#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <iterator>

using namespace hiprt;
using namespace hiprt::test;
using nlohmann::json;

namespace {

const std::string kBvhRender = HIPRT_BVHRENDER;

/// One square of edge 1, and the JSON of its instance.
struct Files {
  TempFolder folder;
  std::string scene = folder / "s.json", out = folder / "s.bvh", rays = folder / "r.rays", hits = folder / "r.hits";

  explicit Files(const json& instance) {
    folder.write("square.obj", grid_obj(1));
    json whole = instance;
    whole["object"] = "square";
    folder.write("s.json", json{{"format", "hiprt scene"},
                                {"version", 1},
                                {"objects", {{"square", {"square.obj"}}}},
                                {"groups", {{"top", {whole}}}},
                                {"scene", "top"}}
                               .dump());
    check_good(run({kBvhBuild, scene, "-o", out}));
  }
  /// Whether a ray down at x meets the square at a time.
  bool is_at(float x, const std::string& time) const {
    const Ray ray{.origin = {x, 0.5f, 5}, .direction = {0, 0, -1}};
    REQUIRE(tools::write_rays(rays, false, {&ray, 1}).has_value());
    check_good(run({kBvhTrace, out, "--rays", rays, "--hits", hits, "--time", time}));
    return tools::read_hits(hits)->at(0).primitive != kInvalidId;
  }
  std::string picture(const std::vector<std::string>& more) const {
    std::vector<std::string> command{kBvhRender, out, "-o", folder / "p.png", "--size", "48x48", "--spp", "16"};
    command.insert(command.end(), {"--camera", "3,0.5,6/3,0.5,0/0,1,0/60", "--mode", "normals"});
    command.insert(command.end(), more.begin(), more.end());
    check_good(run(command));
    std::ifstream file(folder / "p.png", std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

json slide() { return {{"motion", {{"keys", {{{"time", 1}}, {{"time", 2}, {"translate", {4, 0, 0}}}}}}}}; }

}  // namespace

TEST_CASE("a sliding square is at the position of its keys, in every tool") {
  const Files sliding(slide());
  CHECK((sliding.is_at(0.5f, "1") && sliding.is_at(0.5f, "-3") && !sliding.is_at(4.5f, "1")));
  CHECK((sliding.is_at(2.5f, "1.5") && !sliding.is_at(0.5f, "1.5") && !sliding.is_at(4.5f, "1.5")));
  CHECK((sliding.is_at(4.5f, "2") && sliding.is_at(4.5f, "1e30")));
  const json scene = json_of(run({kBvhInfo, sliding.out, "--json"}))["scene"];
  CHECK(scene["instances"]["moving"] == 1);
  CHECK(scene["instances"]["motion_segments"] == 1);
  CHECK(scene["bytes"]["motions"] == 32 + 128);
  CHECK_THAT(run({kBvhInfo, sliding.out}).out, Catch::Contains("moving instances"));
  // The scene is one leaf, whose box moves.
  const std::string dump = run({kBvhInfo, sliding.out, "--dump", "--json"}).out;
  const json leaf = json::parse(dump.substr(0, dump.find('\n')));
  CHECK(leaf["begin"]["min"][0].get<double>() == Approx(0).margin(1e-5));
  CHECK(leaf["end"]["min"][0].get<double>() == Approx(4));
  CHECK_THAT(run({kBvhInfo, sliding.out, "--dump"}).out, Catch::Contains(" begin (") && Catch::Contains(" end ("));
}

TEST_CASE("a picture with a closed shutter shows the positions at that time; an open shutter blurs") {
  const Files sliding(slide()), still(json{{"translate", {2, 0, 0}}});
  CHECK(sliding.picture({"--shutter", "1.5,1.5"}) == still.picture({}));
  CHECK(sliding.picture({"--shutter", "1.5,1.5"}) == still.picture({"--shutter", "0,7"}));
  const std::string blurred = sliding.picture({"--shutter", "1,2"});
  CHECK(blurred != sliding.picture({"--shutter", "1.5,1.5"}));
  CHECK(blurred == sliding.picture({"--shutter", "1,2", "--threads", "1"}));
  const CommandResult wrong = run({kBvhRender, sliding.out, "-o", sliding.folder / "p.png", "--shutter", "2,1"});
  CHECK(wrong.status == 2);
  CHECK_THAT(wrong.err, Catch::Contains("'2,1' is not OPEN,CLOSE, two times in order"));
}

TEST_CASE("invalid motions are refused with their instance, and motion cannot be flattened") {
  const Files sliding(slide());
  const std::vector<std::string> names = sliding.folder.names();
  const auto fails = [&](const json& motion, const std::string& word) {
    json document = json::parse(std::ifstream(sliding.scene));
    document["groups"]["top"][0]["motion"] = motion;
    sliding.folder.write("s.json", document.dump());
    check_failure(sliding.folder, {kBvhBuild, sliding.scene, "-o", sliding.out}, word, names);
  };
  check_failure(sliding.folder, {kBvhBuild, sliding.scene, "-o", sliding.out, "--flatten"},
                "groups.top[0] moves, which a flat scene cannot", names);
  fails({{"keys", {{{"time", 1}}, {{"time", 1}}}}},
        "groups.top[0]: key 1: time 1 is not after that of the key before, 1");
  fails({{"keys", json::array()}}, "groups.top[0].motion.keys: 0 keys, 1 or more expected");
  fails({{"keys", {{{"time", 1}}}}, {"interpolation", "cubic"}},
        "groups.top[0].motion.interpolation: 'cubic', 'slerp', 'nlerp' or 'matrix' expected");
  fails({{"keys", {{{"translate", {1, 2, 3}}}}}}, "groups.top[0].motion.keys[0]: 'time' is missing");
  const json identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  fails({{"keys", {{{"time", 0}, {"matrix", identity}}, {{"time", 1}}}}},
        "groups.top[0].motion.keys[1]: some keys have 'matrix' and some have not");
  fails({{"keys", {{{"time", 0}, {"matrix", identity}, {"shear", {0, 0, 0}}}}}},
        "groups.top[0].motion.keys[0]: has both 'matrix' and 'shear'");
  json turned = identity;
  turned[0] = turned[5] = -1;
  fails(
      {{"interpolation", "matrix"}, {"keys", {{{"time", 0}, {"matrix", identity}}, {{"time", 1}, {"matrix", turned}}}}},
      "groups.top[0]: between keys 0 and 1, at 0.5 of the way, the transform has no inverse");
}
