/// Skins and morph targets that deform while the shutter is open, as users build and trace them.

#include <tests/oracle/random.h>
#include <tests/tools/json_result.h>
#include <tests/tools/load.h>
#include <tests/tools/programs.h>
#include "gltf_builder.h"

#include <tools/scene_io/rays_file.h>

#include <bit>
#include <span>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;
using oracle::Random;

namespace {

/// A triangle (0, 0), (1, 0), (0, 1) whose morph target lifts it by 4. Its weight goes from 0 to 1 in a second.
struct Lift : GltfBuilder {
  Lift() {
    add_mesh(add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", add_positions({0, 0, 4, 0, 0, 4, 0, 0, 4})}}};
    json["nodes"] = {{{"mesh", 0}}};
    json["scenes"] = {{{"nodes", {0}}}};
    animate(0, "weights", {0, 1}, {0, 1});
  }
};

/// Random triangles in [-1, 1]^3 with random weights of two joints. One joint turns, the other moves.
struct Wriggle : GltfBuilder {
  explicit Wriggle(Random& random) {
    constexpr std::size_t kCorners = 90;
    std::vector<float> positions, weights;
    std::vector<std::uint8_t> joints;
    for (std::size_t i = 0; i < kCorners; ++i) {
      for (int axis = 0; axis < 3; ++axis) positions.push_back(random.uniform_float(-1, 1));
      const float first = random.uniform_float(0, 1);
      weights.insert(weights.end(), {first, 1 - first, 0, 0});
      joints.insert(joints.end(), {0, 1, 0, 0});
    }
    add_mesh(add_positions(positions));
    nlohmann::json& attributes = json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = add_accessor(joints, 5121, "VEC4", kCorners);
    attributes["WEIGHTS_0"] = add_accessor(weights, 5126, "VEC4", kCorners);
    json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, {{"translation", {0, 0, 0}}}, {{"translation", {0, 0, 0}}}};
    json["skins"] = {{{"joints", {1, 2}}}};
    json["scenes"] = {{{"nodes", {0, 1, 2}}}};
    const float h = std::sqrt(0.5f);
    animate(1, "rotation", {0, 1}, {0, 0, 0, 1, h, 0, 0, h});
    animate(2, "translation", {0, 0.5f, 1}, {0, 0, 0, 1, 0, 0, 0, -1, 0});
  }
};

struct Traced {
  TempFolder folder;
  std::string gltf, out = folder / "a.bvh";

  explicit Traced(const GltfBuilder& file) : gltf(folder.write("a.glb", file.glb()).string()) {}
  void build(const std::vector<std::string>& more) const {
    std::vector<std::string> command{kBvhBuild, gltf, "-o", out, "--instances"};
    command.insert(command.end(), more.begin(), more.end());
    check_good(run(command));
  }
  std::vector<tools::HitRecord> hits(std::span<const Ray> rays, const std::string& time) const {
    const std::string from = folder / "r.rays", to = folder / "h.hits";
    REQUIRE(tools::write_rays(from, false, rays).has_value());
    check_good(run({kBvhTrace, out, "--rays", from, "--hits", to, "--time", time}));
    return *tools::read_hits(to);
  }
};

bool is_hit(const tools::HitRecord& hit) { return hit.primitive != kInvalidId; }

constexpr Ray kDown{.origin = {0.25f, 0.25f, 8}, .direction = {0, 0, -1}};

}  // namespace

TEST_CASE("a morph target deforms while the shutter is open") {
  const Traced lift{Lift{}};
  lift.build({"--shutter", "0,1"});
  for (const auto& [time, t] :
       {std::pair{"-1", 8.0f}, {"0", 8.0f}, {"0.25", 7.0f}, {"0.5", 6.0f}, {"1", 4.0f}, {"7", 4.0f}})
    CHECK(lift.hits({&kDown, 1}, time)[0].t == t);
  const json info = json_of(run({kBvhInfo, "--validate", lift.out, "--json"}));
  CHECK((info["valid"] == true && info["bounds"]["max"][2].get<double>() == Approx(4).margin(1e-3)));
  CHECK_THAT(run({kBvhInfo, lift.out}).out, Contains("scene"));
  // A closed shutter, and none at all.
  lift.build({"--shutter", "0.5,0.5"});
  CHECK(lift.hits({&kDown, 1}, "0")[0].t == 6.0f);
  CHECK_THAT(run({kBvhBuild, lift.gltf, "-o", lift.out, "--instances"}).err, Contains("ignored: animations (1)"));
  CHECK(lift.hits({&kDown, 1}, "1")[0].t == 8.0f);
}

TEST_CASE("a node moves and deforms at the same time, and a still copy stays") {
  Lift gltf;
  gltf.animate(0, "translation", {0, 1}, {0, 0, 0, 2, 0, 0});
  gltf.json["nodes"].push_back({{"mesh", 0}, {"translation", {0, 5, 0}}});
  gltf.json["scenes"] = {{{"nodes", {0, 1}}}};
  const Traced traced(gltf);
  traced.build({"--shutter", "0,1"});
  const std::vector<Ray> rays{kDown,
                              {.origin = {1.25f, 0.25f, 8}, .direction = {0, 0, -1}},
                              {.origin = {0.25f, 5.25f, 8}, .direction = {0, 0, -1}}};
  const std::vector<tools::HitRecord> begin = traced.hits(rays, "0"), middle = traced.hits(rays, "0.5");
  CHECK((begin[0].t == 8.0f && !is_hit(begin[1]) && begin[2].t == 8.0f));
  CHECK((!is_hit(middle[0]) && middle[1].t == Approx(6).margin(1e-4) && middle[2].t == 8.0f));
}

TEST_CASE("a skin at the time of a key is the still mesh of that time, bit for bit") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const Traced moving{Wriggle(random)}, still{Wriggle(random)};
    std::filesystem::copy_file(moving.gltf, still.gltf, std::filesystem::copy_options::overwrite_existing);
    std::vector<Ray> rays(500);
    for (Ray& ray : rays) {
      const auto coordinate = [&] { return random.uniform_float(-1.5, 1.5); };
      ray.origin = {coordinate(), coordinate(), 5};
      ray.direction = Vec3(coordinate(), coordinate(), -1) - ray.origin;
    }
    moving.build({"--shutter", "0,1", "--motion-keys", "5"});
    std::size_t found = 0;
    for (const std::string time : {"0", "0.25", "0.5", "0.75", "1"}) {
      INFO("time " << time);
      still.build({"--shutter", time + "," + time});
      const std::vector<tools::HitRecord> got = moving.hits(rays, time), expected = still.hits(rays, "0");
      for (std::size_t i = 0; i < rays.size(); ++i) {
        REQUIRE(got[i].primitive == expected[i].primitive);
        REQUIRE(std::bit_cast<std::uint32_t>(got[i].t) == std::bit_cast<std::uint32_t>(expected[i].t));
        found += is_hit(got[i]) ? 1 : 0;
      }
    }
    CHECK(found > rays.size());
  }
}

TEST_CASE("what deforms is not flattened: the message says why") {
  const Traced lift{Lift{}};
  const CommandResult flat =
      run({kBvhBuild, lift.gltf, "-o", lift.out, "--instances", "--flatten", "--shutter", "0,1"});
  CHECK(flat.status == 1);
  CHECK_THAT(flat.err, Contains("a.glb mesh 0 of node 0 deforms, which a flat scene cannot"));
}

TEST_CASE("--cache keeps what deforms apart from other keys and times") {
  const Traced lift{Lift{}};
  const std::string cache = lift.folder / "cache";
  lift.build({"--shutter", "0,1", "--cache", cache});
  lift.build({"--shutter", "0,0.5", "--cache", cache});
  CHECK(lift.hits({&kDown, 1}, "1")[0].t == 6.0f);
  lift.build({"--shutter", "0,1", "--cache", cache});
  CHECK(lift.hits({&kDown, 1}, "1")[0].t == 4.0f);
}
