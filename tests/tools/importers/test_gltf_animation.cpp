/// glTF animations as keys of instances.

#include <tests/tools/json_result.h>
#include <tests/tools/load.h>
#include <tests/tools/programs.h>
#include "gltf_builder.h"

using namespace hiprt;
using namespace hiprt::test;
using nlohmann::json;

namespace {

/// Node 0 has node 1, which has a triangle; two seconds of an animation of node 0.
struct Animated : GltfBuilder {
  Animated() {
    add_mesh(add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    json["scenes"] = {{{"nodes", {0}}}};
    json["nodes"] = {{{"children", {1}}}, {{"mesh", 0}, {"translation", {0, 0, 1}}}};
    json["animations"] = {{{"channels", nlohmann::json::array()}, {"samplers", nlohmann::json::array()}}};
  }
  Animated& channel(const std::string& path, const std::string& interpolation, const std::vector<float>& times,
                    const std::vector<float>& values, int node = 0) {
    auto& animation = json["animations"][0];
    const std::size_t components = path == "rotation" ? 4 : 3;
    const int input = add_accessor(times, 5126, "SCALAR", times.size());
    const int output = add_accessor(values, 5126, components == 4 ? "VEC4" : "VEC3", values.size() / components);
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
    animation["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", interpolation}});
    return *this;
  }
  tools::MeshUse use(const std::vector<float>& times) const {
    const TempFolder folder;
    auto assembly = tools::load_assembly(folder.write("a.glb", glb()), times);
    if (!assembly) FAIL(assembly.error().message);
    REQUIRE(assembly->uses.size() == 1);
    return assembly->uses[0];
  }
  /// Of keys, the position of the triangle's corner 0 along an axis.
  std::vector<double> positions(const std::vector<float>& times, unsigned axis) const {
    std::vector<double> result;
    for (const auto& key : use(times).keys) result.push_back(key.m[axis][3]);
    return result;
  }
  std::string fault() const {
    const TempFolder folder;
    const std::string path = folder.write("a.glb", glb());
    const auto assembly = tools::load_assembly(path, {0.0f});
    if (assembly) FAIL("accepted");
    CHECK(tools::load_assembly(path).has_value());
    return assembly.error().message.substr(path.size() + 2);
  }
};

void check_near(const std::vector<double>& is, const std::vector<double>& expected) {
  REQUIRE(is.size() == expected.size());
  for (std::size_t i = 0; i < is.size(); ++i) CHECK(is[i] == Approx(expected[i]).margin(1e-6));
}

}  // namespace

TEST_CASE("glTF animation: translations step, run and swing from key to key") {
  const std::vector<float> times{0, 1, 2}, looks{-1, 0, 0.5, 1, 1.25, 2, 9};
  const std::vector<float> x{0, 0, 0, 4, 0, 0, 8, 0, 0};
  check_near(Animated().channel("translation", "STEP", times, x).positions(looks, 0), {0, 0, 0, 4, 4, 8, 8});
  check_near(Animated().channel("translation", "LINEAR", times, x).positions(looks, 0), {0, 0, 2, 4, 5, 8, 8});
  // Tangents in and out around each value; Hermite at half the way: mean, and an eighth of the tangents' difference.
  const std::vector<float> cubic{9, 9, 9, 0, 0, 0, 8, 0, 0, 0, 0, 0, 4, 0, 0, 9, 9, 9};
  check_near(Animated().channel("translation", "CUBICSPLINE", {0, 2}, cubic).positions({0, 1, 2}, 0), {0, 4, 4});
}

TEST_CASE("glTF animation: rotations take the shorter arc, scales are interpolated, other nodes do not move") {
  const float h = std::sqrt(0.5f);
  // A quarter turn about x, its quaternion of the other sign: z goes to -y.
  const Animated turning = Animated().channel("rotation", "LINEAR", {0, 1}, {0, 0, 0, 1, -h, 0, 0, -h});
  check_near(turning.positions({0, 0.5, 1}, 1), {0, -std::sqrt(0.5), -1});
  check_near(turning.positions({0, 0.5, 1}, 2), {1, std::sqrt(0.5), 0});
  check_near(Animated().channel("scale", "LINEAR", {0, 1}, {1, 1, 1, 1, 1, 3}).positions({0, 0.5, 1}, 2), {1, 2, 3});
  CHECK(Animated().channel("translation", "LINEAR", {0, 1}, {1, 2, 3, 1, 2, 3}).use({0, 1}).keys.empty());
  const tools::MeshUse posed = turning.use({1.0f});
  CHECK(posed.keys.empty());
  CHECK(posed.to_world.m[1][3] == Approx(-1));
  CHECK(turning.use({}).to_world.m[2][3] == 1);
}

TEST_CASE("glTF animation: invalid animations are refused with animation and channel") {
  const std::string where = "animation 0, channel 0: ";
  const std::vector<float> two{0, 0, 0, 1, 1, 1};
  CHECK(Animated().channel("translation", "LINEAR", {1, 0}, two).fault() ==
        where + "key 1 is not after the one before");
  CHECK(Animated().channel("translation", "LINEAR", {0, 1, 2}, two).fault() == where + "2 values, 3 expected");
  CHECK(Animated().channel("translation", "CUBICSPLINE", {0, 1}, two).fault() == where + "2 values, 6 expected");
  CHECK(Animated().channel("translation", "WAVE", {0, 1}, two).fault() == where + "unknown interpolation 'WAVE'");
  CHECK(Animated().channel("colour", "LINEAR", {0, 1}, two).fault() == where + "unknown path 'colour'");
  CHECK(Animated().channel("translation", "LINEAR", {0, 1}, two, 7).fault() == where + "node 7 does not exist");
  const float inf = std::numeric_limits<float>::infinity();
  CHECK(Animated().channel("translation", "LINEAR", {0, inf}, two).fault() == where + "a number is not finite");
  Animated matrix = Animated().channel("translation", "LINEAR", {0, 1}, two);
  matrix.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  CHECK(matrix.fault() == where + "node 0 has a matrix");
}

TEST_CASE("glTF animation: bvhbuild --shutter makes nodes move") {
  const TempFolder folder;
  const float h = std::sqrt(0.5f);
  const std::string gltf =
      folder.write("a.gltf", Animated().channel("rotation", "LINEAR", {0, 2}, {0, 0, 0, 1, h, 0, 0, h}).embedded());
  const std::string out = folder / "a.bvh";
  check_good(run({kBvhBuild, gltf, "-o", out, "--instances", "--shutter", "0,2", "--motion-keys", "5"}));
  const json instances = json_of(run({kBvhInfo, out, "--json"}))["scene"]["instances"];
  CHECK((instances["moving"] == 1 && instances["motion_segments"] == 4));
  const CommandResult still = run({kBvhBuild, gltf, "-o", out, "--instances"});
  CHECK((still.status == 0 && still.err.ends_with("a.gltf: ignored: animations (1)\n")));
  CHECK(json_of(run({kBvhInfo, out, "--json"}))["scene"]["instances"]["moving"] == 0);
  const CommandResult alone = run({kBvhBuild, gltf, "-o", out, "--shutter", "0,2"});
  CHECK(alone.status == 2);
  CHECK_THAT(alone.err, Catch::Contains("--shutter goes with --instances"));
  CHECK(run({kBvhBuild, gltf, "-o", out, "--instances", "--motion-keys", "5"}).status == 2);
}
