/// bvhrender --integrator path as a user runs it.

#include "read_images.h"
#include "renderer.h"

#include <tests/tools/importers/gltf_builder.h>
#include <tools/render/image/image.h>
#include <tools/render/image/image_write.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <hiprt_build/shapes.h>

#include <nlohmann/json.hpp>

#include <csignal>
#include <set>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// A red floor of side 8 below a lamp of side 2 at y = 4. @return the path; x.bvh beside it is its BVH, with balls.
std::string write_lit_floor(const TempFolder& folder, const std::vector<ShapePoint>& balls = {}) {
  GltfBuilder b;
  const auto square = [&](float half, float y, int material) {
    const int mesh = b.add_mesh(b.add_positions({-half, y, -half, half, y, -half, half, y, half, -half, y, half}),
                                b.add_accessor(std::vector<std::uint16_t>{0, 2, 1, 0, 3, 2}, 5123, "SCALAR", 6));
    b.json["meshes"][static_cast<std::size_t>(mesh)]["primitives"][0]["material"] = material;
    b.json["nodes"].push_back({{"mesh", mesh}});
  };
  square(4, 0, 0);
  square(1, 4, 1);
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.1, 0.1, 1}}, {"metallicFactor", 0}}}},
                         {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
                          {"emissiveFactor", {1, 1, 1}},
                          {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}}};
  b.json["extensionsUsed"] = {"KHR_materials_emissive_strength"};
  b.json["scenes"] = {{{"nodes", {0, 1}}}};
  std::string path = folder.write("lit.gltf", b.embedded());
  const auto mesh = tools::load_mesh(path);
  REQUIRE(mesh.has_value());
  const build::TriangleMesh view{.positions = mesh->positions, .triangles = mesh->triangles};
  const build::Shapes shapes{ShapeKind::kSpheres, balls, {}};
  const auto boxes = build::shape_boxes(shapes);
  REQUIRE(boxes.has_value());
  const build::CustomGeometry custom{.boxes = *boxes, .shapes = shapes};
  const auto bvh = build::build(build::SceneInput{{&view, 1}, {&custom, balls.empty() ? 0u : 1u}});
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "x.bvh", bvh->buffer.bytes()).has_value());
  return path;
}

const std::string kAbove = "0,3,5/0,0,0/0,1,0/50";

}  // namespace

TEST_CASE("bvhrender --integrator path: materials, light, and layers with pbrt's names") {
  const TempFolder folder;
  const std::string gltf = write_lit_floor(folder);
  const std::string black = folder / "sky.exr";
  REQUIRE(tools::write_exr(black, tools::Image(4, 2), {}).has_value());
  const json told = json::parse(render_well({folder / "x.bvh", "-o", folder / "a.exr", "-o", folder / "a.png", "--size",
                                             "33x25", "--camera", kAbove, "--spp", "16", "--integrator", "path",
                                             "--materials", gltf, "--environment", black, "--json"}));
  CHECK(told.at("mode") == "path");
  CHECK(told.at("spp") == 16);
  CHECK(told.at("primary_rays") == 33 * 25 * 16);
  CHECK(told.at("secondary_rays") > 0);
  const ExrFile file = read_exr(folder / "a.exr");
  std::set<std::string> names;
  for (const auto& channel : file.floats) names.insert(channel.first);
  for (const char* name : {"R",
                           "G",
                           "B",
                           "N.X",
                           "P.X",
                           "Z",
                           "Albedo.R",
                           "Albedo.G",
                           "Albedo.B",
                           "Ns.X",
                           "Ns.Y",
                           "Ns.Z",
                           "u",
                           "v",
                           "Variance.R",
                           "Variance.G",
                           "Variance.B",
                           "RelativeVariance.R",
                           "RelativeVariance.G",
                           "RelativeVariance.B"})
    CHECK(names.count(name) == 1);
  CHECK(file.at("Albedo.R", 16, 16) == Approx(0.8f));
  CHECK(file.at("Albedo.G", 16, 16) == Approx(0.1f));
  CHECK(file.at("Ns.Y", 16, 16) == Approx(1.0f));
  CHECK(file.at("R", 16, 16) > 0.1f);
  CHECK(file.at("R", 16, 16) > 3.0f * file.at("G", 16, 16));
  CHECK(file.at("Variance.R", 16, 16) > 0.0f);
  CHECK(file.attributes.at("mode") == "path");
  const std::string text =
      render_well({folder / "x.bvh", "-o", folder / "b.exr", "--size", "33x25", "--camera", kAbove, "--spp", "16",
                   "--integrator", "path", "--materials", gltf, "--environment", black, "--threads", "2"});
  CHECK_THAT(text, Contains("16 samples, path:"));
  CHECK(read_exr(folder / "b.exr").floats == file.floats);
}

TEST_CASE("bvhrender --integrator path: glTF's materials beside spheres of clay") {
  const TempFolder folder;
  const std::string gltf = write_lit_floor(folder, {{{0, 1, 0}, 0.5f}});
  const std::string balls = folder.write("balls.xyzr", "0 1 0 0.5\n");
  render_well({folder / "x.bvh", "-o", folder / "a.exr", "--size", "33x25", "--camera", "0,3,5/0,1,0/0,1,0/50", "--spp",
               "4", "--integrator", "path", "--materials", balls, gltf});
  const ExrFile file = read_exr(folder / "a.exr");
  CHECK(file.at("Albedo.G", 16, 12) == Approx(0.775f));
  CHECK(file.at("Albedo.G", 16, 20) == Approx(0.1f));
  CHECK(file.at("R", 16, 12) > 0.05f);
}

TEST_CASE("bvhrender --integrator path: clay in a studio without files") {
  const TempFolder folder;
  render_well({write_squares(folder), "-o", folder / "a.exr", "--size", "33x25", "--camera", kFront, "--spp", "16",
               "--integrator", "path"});
  const ExrFile file = read_exr(folder / "a.exr");
  CHECK(file.at("R", 16, 12) > 0.05f);
  CHECK(file.at("Albedo.R", 16, 12) == Approx(0.8f));
  CHECK(file.at("R", 0, 0) > 0.05f);
}

TEST_CASE("bvhrender --integrator path: an interrupted run keeps its samples and says how many") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), out = folder / "a.exr";
  bool cancelled = false;
  for (const int delay : {700, 1500, 4000}) {
    Command command({kBvhRender, scene, "-o", out, "--size", "64x48", "--camera", kFront, "--spp", "65536",
                     "--integrator", "path"});
    REQUIRE_FALSE(command.ends_within(std::chrono::milliseconds(delay)));
    command.signal(SIGINT);
    const CommandResult result = command.finish();
    CHECK(result.status == 1);
    if (!std::filesystem::exists(out)) continue;
    CHECK_THAT(result.err, Contains("bvhrender: cancelled: ") && Contains(" of 65536 samples"));
    CHECK(read_exr(out).at("R", 32, 24) > 0.05f);
    cancelled = true;
    break;
  }
  CHECK(cancelled);
}

TEST_CASE("bvhrender --integrator path: errors are reported") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), gltf = write_lit_floor(folder);
  const auto refuses = [&](int status, std::vector<std::string> more, const std::string& word) {
    more.insert(more.begin(), {scene, "-o", folder / "out.png"});
    const CommandResult result = render(more);
    CHECK(result.status == status);
    CHECK_THAT(result.err, Contains(word));
    CHECK_FALSE(std::filesystem::exists(folder / "out.png"));
  };
  refuses(2, {"--bounces", "3"}, "--bounces is of --integrator path");
  refuses(2, {"--materials", gltf}, "--materials is of --integrator path");
  refuses(2, {"--integrator", "path", "--mode", "ao"}, "--mode is not of --integrator path");
  refuses(2, {"--integrator", "light"}, "--integrator");
  const std::string other = folder.write("other.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  refuses(1, {"--integrator", "path", "--materials", other}, "geometr");
  refuses(1, {"--integrator", "path", "--materials", folder / "none.glb"}, "none.glb");
  refuses(1, {"--integrator", "path", "--environment", gltf}, "lit.gltf");
  refuses(1, {"--integrator", "path", "--environment", folder / "out.png"}, "out.png");
}
