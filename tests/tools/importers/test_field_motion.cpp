/// Motions as animators write them: nodes that are scaled to 0 to hide them, and whole turns.

#include <tests/tools/json_result.h>
#include <tests/tools/load.h>
#include <tests/tools/programs.h>
#include "gltf_builder.h"

#include <tools/scene_io/rays_file.h>
#include <tools/scene_io/scene/scene_motion.h>

#include <numbers>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// A node with the triangle (0, 0), (1, 0), (0, 1), and a channel of an animation.
struct Moving : GltfBuilder {
  Moving(const std::string& path, const std::vector<float>& times, const std::vector<float>& values,
         const std::string& interpolation = "LINEAR") {
    add_mesh(add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    json["scenes"] = {{{"nodes", {0}}}};
    json["nodes"] = {{{"mesh", 0}}};
    animate(0, path, times, values, interpolation);
  }
};

/// A built scene and rays down at it.
struct Built {
  TempFolder folder;
  std::string out = folder / "a.bvh", rays = folder / "r.rays", hits = folder / "h.hits";
  CommandResult building;

  Built(const GltfBuilder& gltf, const std::vector<std::string>& more) {
    std::vector<std::string> command{kBvhBuild, folder.write("a.gltf", gltf.embedded()), "-o", out, "--instances"};
    command.insert(command.end(), more.begin(), more.end());
    building = run(command);
  }
  explicit Built(const json& motion) {
    folder.write("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const json scene{{"format", "hiprt scene"},
                     {"version", 1},
                     {"objects", {{"triangle", {"triangle.obj"}}}},
                     {"groups", {{"top", {{{"object", "triangle"}, {"motion", motion}}}}}},
                     {"scene", "top"}};
    building = run({kBvhBuild, folder.write("a.json", scene.dump()), "-o", out});
  }
  bool is_hit(float x, float y, const std::string& time) const {
    const Ray ray{.origin = {x, y, 5}, .direction = {0, 0, -1}};
    REQUIRE(tools::write_rays(rays, false, {&ray, 1}).has_value());
    check_good(run({kBvhTrace, out, "--rays", rays, "--hits", hits, "--time", time}));
    return tools::read_hits(hits)->at(0).primitive != kInvalidId;
  }
};

const std::vector<float> kToNothing{1, 1, 1, 0, 0, 0};

}  // namespace

TEST_CASE("a key that scales a node to 0 hides it at that time; before it shrinks") {
  const Built built(Moving("scale", {0, 1}, kToNothing), {"--shutter", "0,1"});
  check_good(built.building);
  CHECK(built.is_hit(0.4f, 0.4f, "0"));
  // At half of the time it has half of its size.
  CHECK((built.is_hit(0.24f, 0.24f, "0.5") && !built.is_hit(0.26f, 0.26f, "0.5")));
  CHECK((built.is_hit(0.04f, 0.04f, "0.9") && !built.is_hit(0.06f, 0.06f, "0.9")));
  for (const std::string time : {"1", "2", "1e30"})
    CHECK((!built.is_hit(0, 0, time) && !built.is_hit(0.4f, 0.4f, time) && !built.is_hit(1e-7f, 0, time)));
  const json info = json_of(run({kBvhInfo, built.out, "--json"}));
  CHECK((info["valid"] == true && info["scene"]["instances"]["moving"] == 1));
  CHECK(info["bounds"]["max"][0].get<double>() == Approx(1).margin(1e-3));
}

TEST_CASE("a key that scales a node to nearly nothing builds, too") {
  for (const float scale : {1e-10f, 1e-20f, 1e-30f, 1e-44f}) {
    const Built built(Moving("scale", {0, 1}, {1, 1, 1, scale, scale, scale}), {"--shutter", "0,1"});
    check_good(built.building);
    CHECK((built.is_hit(0.24f, 0.24f, "0.5") && !built.is_hit(0.26f, 0.26f, "0.5") && !built.is_hit(0.1f, 0.1f, "1")));
    const Built late(Moving("scale", {0, 1}, {scale, scale, scale, 1, 1, 1}), {"--shutter", "0,1"});
    check_good(late.building);
    CHECK((late.is_hit(0.24f, 0.24f, "0.5") && !late.is_hit(0.26f, 0.26f, "0.5") && !late.is_hit(0.1f, 0.1f, "0")));
  }
}

TEST_CASE("a node that comes and goes: hidden between two keys of scale 0") {
  const std::vector<float> scales{1, 1, 1, 0, 0, 0, 0, 0, 0, 1, 1, 1};
  const Built built(Moving("scale", {0, 1, 2, 3}, scales), {"--shutter", "0,3", "--motion-keys", "4"});
  check_good(built.building);
  for (const std::string time : {"0", "0.5", "2.5", "3"}) CHECK(built.is_hit(0.1f, 0.1f, time));
  for (const std::string time : {"1", "1.25", "1.5", "2"})
    CHECK((!built.is_hit(0.1f, 0.1f, time) && !built.is_hit(0, 0, time)));
  // From the first key on.
  const Built late(Moving("scale", {0, 1}, {0, 0, 0, 1, 1, 1}), {"--shutter", "0,1"});
  check_good(late.building);
  CHECK((!late.is_hit(0, 0, "0") && late.is_hit(0.2f, 0.2f, "0.5") && late.is_hit(0.4f, 0.4f, "1")));
}

TEST_CASE("parts, matrices and all kinds of motion hide alike; one that all keys hide is never seen") {
  const json zero{0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0}, one{1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 0};
  for (const std::string kind : {"slerp", "nlerp", "matrix"}) {
    INFO(kind);
    for (const bool matrices : {false, true}) {
      json first{{"time", 0}}, last{{"time", 1}};
      if (matrices)
        first["matrix"] = one, last["matrix"] = zero;
      else
        first["translate"] = last["translate"] = {3, 0, 0}, last["scale"] = 0;
      const Built built(json{{"interpolation", kind}, {"keys", {first, last}}});
      check_good(built.building);
      CHECK((built.is_hit(3.4f, 0.4f, "0") && built.is_hit(3.24f, 0.24f, "0.5") && !built.is_hit(3.26f, 0.26f, "0.5")));
      CHECK((!built.is_hit(3, 0, "1") && !built.is_hit(3.0001f, 0, "1")));
    }
  }
  const Built hidden(
      json{{"keys", {{{"time", 0}, {"scale", 0}}, {{"time", 1}, {"scale", 0}, {"translate", {5, 0, 0}}}}}});
  check_good(hidden.building);
  for (const std::string time : {"0", "0.5", "1"})
    CHECK((!hidden.is_hit(0, 0, time) && !hidden.is_hit(0.2f, 0.2f, time)));
}

TEST_CASE("a mirrored node that is hidden in between may come back unmirrored") {
  const json keys{{{"time", 0}, {"scale", -1}}, {{"time", 1}, {"scale", 0}}, {{"time", 2}, {"scale", 1}}};
  const Built built(json{{"keys", keys}});
  check_good(built.building);
  CHECK((built.is_hit(-0.4f, -0.4f, "0") && !built.is_hit(0, 0, "1") && built.is_hit(0.4f, 0.4f, "2")));
  CHECK(Built(json{{"keys", {keys[0], {{"time", 2}, {"scale", 1}}}}}).building.status == 1);
}

TEST_CASE("a flat key keeps the scene: a little thickness, and a warning") {
  const Built built(Moving("scale", {0, 1}, {1, 1, 1, 1, 1, 0}), {"--shutter", "0,1"});
  INFO(built.building.err);
  CHECK(built.building.status == 0);
  CHECK_THAT(built.building.err, Contains("keys of motions that are flat: 1, the first of instances[0]"));
  for (const std::string time : {"0", "0.5", "1"})
    CHECK((built.is_hit(0.4f, 0.4f, time) && !built.is_hit(0.6f, 0.6f, time)));
  const Built parts(json{{"keys", {{{"time", 0}}, {{"time", 1}, {"scale", {1, 0, 1}}}}}});
  CHECK(parts.building.status == 0);
  CHECK_THAT(parts.building.err, Contains("groups.top[0]"));
}

TEST_CASE("a static scale of 0 is baked, as before") {
  Moving gltf("translation", {0, 1}, {0, 0, 0, 0, 0, 0});
  gltf.json["nodes"][0]["scale"] = {1, 1, 0};
  const Built built(gltf, {"--shutter", "0,1"});
  CHECK(built.building.status == 0);
  CHECK_THAT(built.building.err, Contains("instances without inverse: 1"));
  CHECK(built.is_hit(0.4f, 0.4f, "0.5"));
}

TEST_CASE("turns that motions do not make are named") {
  const auto turn = [](double degrees) {
    const double half = degrees * std::numbers::pi / 360;
    return std::vector<float>{0, 0, 0, 1, 0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))};
  };
  const Built whole(Moving("rotation", {0, 1}, turn(360)), {"--shutter", "0,1"});
  CHECK(whole.building.status == 0);
  CHECK_THAT(whole.building.err,
             Contains("animation 0, channel 0: keys 0 and 1 are one orientation") && Contains("360 degrees"));
  const std::vector<float> thirds{0, 0, 0, 1, 0, 0, std::sqrt(0.75f), 0.5f, 0, 0, std::sqrt(0.75f), -0.5f, 0, 0, 0, -1};
  const Built sampled(Moving("rotation", {0, 1, 2, 3}, thirds), {"--shutter", "0,3"});
  CHECK_THAT(sampled.building.err, Contains("node 0 turns by 360 degrees between two --motion-keys"));
  check_good(Built(Moving("rotation", {0, 1, 2, 3}, thirds), {"--shutter", "0,3", "--motion-keys", "4"}).building);
  check_good(Built(Moving("rotation", {0, 1}, turn(170)), {"--shutter", "0,1"}).building);
  const auto document = [](double degrees) {
    return Built(json{{"keys",
                       {{{"time", 0}, {"rotate", {{"axis", {0, 0, 1}}, {"degrees", 0}}}},
                        {{"time", 1}, {"rotate", {{"axis", {0, 0, 1}}, {"degrees", degrees}}}}}}})
        .building.err;
  };
  CHECK_THAT(document(360), Contains("groups.top[0].motion.keys[1]: a turn of 360") && Contains("shorter arc"));
  CHECK_THAT(document(270), Contains("a turn of 270"));
  CHECK(document(180).empty());
}
