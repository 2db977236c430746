/// Surfaces have the numbers of a BVH's hits, whatever the BVH was built of.

#include <tests/tools/built_inputs.h>
#include <tests/tools/scene_file.h>
#include "hair_files.h"

#include <hiprt_build/format/view.h>
#include <hiprt_device/scene_view.h>
#include <tests/oracle/random.h>
#include <tools/render/tracers/tracer.h>

#include <array>
#include <cmath>
#include <map>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;
using oracle::Random;

namespace {

constexpr const char* kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n";

/// A mesh of three primitives of random triangles in the unit cube: a list, a strip and a fan, with and without
/// indices. A vertex's texture coordinates are its x and y; primitive p has material p and z from p to p + 1.
int add_random_mesh(GltfBuilder& b, Random& random) {
  json primitives = json::array();
  const auto z_of = [&](int p) { return static_cast<float>(p) + random.uniform_float(0.01, 0.99); };
  for (const int mode : {4, 5, 6}) {
    const std::size_t corners = 3 * (1 + random.below(6));
    std::vector<float> positions, coordinates;
    for (std::size_t i = 0; i < corners; ++i) {
      const float x = random.uniform_float(0, 1), y = random.uniform_float(0, 1);
      positions.insert(positions.end(), {x, y, z_of(mode - 4)});
      coordinates.insert(coordinates.end(), {x, y});
    }
    json primitive = {{"mode", mode}, {"material", mode - 4}};
    primitive["attributes"]["POSITION"] = b.add_positions(positions);
    primitive["attributes"]["TEXCOORD_0"] = b.add_accessor(coordinates, 5126, "VEC2", corners);
    if (random.coin()) {
      std::vector<std::uint16_t> indices;
      for (std::size_t i = 0; i < corners; ++i)
        indices.push_back(static_cast<std::uint16_t>(random.below(static_cast<std::uint32_t>(corners))));
      primitive["indices"] = b.add_accessor(indices, 5123, "SCALAR", corners);
    }
    primitives.push_back(primitive);
  }
  b.json["meshes"].push_back({{"primitives", primitives}});
  return static_cast<int>(b.json["meshes"].size()) - 1;
}

/// Nodes n at x = 10 n, of random meshes; those with odd numbers are mirrored in x there.
GltfBuilder random_file(Random& random, unsigned nodes) {
  GltfBuilder b;
  for (int m = 0; m < 2; ++m) add_random_mesh(b, random);
  for (int p = 0; p < 3; ++p) b.json["materials"].push_back({{"name", "m" + std::to_string(p)}});
  json roots = json::array();
  for (unsigned n = 0; n < nodes; ++n) {
    const int mirror = n % 2 != 0 ? -1 : 1;
    b.json["nodes"].push_back({{"mesh", random.below(2)}, {"translation", {10 * n, 0, 0}}, {"scale", {mirror, 1, 1}}});
    roots.push_back(n);
  }
  b.json["scenes"] = {{{"nodes", roots}}};
  return b;
}

/// Where a point of random_file()'s nodes is in its mesh.
std::array<float, 3> local(const Vec3& p) {
  const float n = std::round(p.x / 10), x = p.x - 10 * n;
  return {std::fmod(n, 2.0f) != 0 ? -x : x, p.y, p.z};
}

const tools::GeometrySurface& geometry_of(const tools::SceneSurfaces& surfaces, const BufferView& view, const Hit& hit,
                                          std::uint32_t instance) {
  const std::size_t object = view.has_instances() ? view.instances[instance].object : 0;
  return surfaces.objects.at(object).at(hit.geometry);
}

/// Rays at random points of a random file's nodes: the surface of each hit is right.
void check_hits(const tools::BuildCommand& command, Random& random, unsigned nodes) {
  const build::Buffer file = build_inputs(command);
  const BufferView view = view_of(file);
  const auto surfaces = value_of(tools::load_surfaces(command.inputs, view));
  std::vector<Ray> rays(4000);
  for (Ray& ray : rays) {
    const auto n = static_cast<float>(random.below(nodes));
    const float x = random.uniform_float(0, 1), mirror = std::fmod(n, 2.0f) != 0 ? -1.0f : 1.0f;
    ray.origin = Vec3(10 * n + mirror * x, random.uniform_float(0, 1), random.coin() ? -1.0f : 4.0f);
    ray.direction = Vec3(random.uniform_float(-0.1, 0.1), random.uniform_float(-0.1, 0.1), ray.origin.z < 0 ? 1 : -1);
  }
  const SceneView scene = make_scene_view(view);
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint32_t> paths(scene.levels * rays.size());
  tools::trace(scene, tools::Query::kClosest, {}, rays, hits, {}, paths);
  unsigned found = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit& hit = hits[i];
    if (!hit.found()) continue;
    ++found;
    const auto& geometry = geometry_of(surfaces, view, hit, paths.empty() ? 0 : paths[i * scene.levels]);
    REQUIRE(geometry.triangles.size() == geometry.materials.size());
    const auto point = local(rays[i].origin + hit.t * rays[i].direction);
    const build::Triangle& corners = geometry.triangles.at(hit.primitive);
    const std::array<float, 3> weights{1 - hit.u - hit.v, hit.u, hit.v};
    std::array<float, 2> at{0, 0};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 2; ++axis) at[axis] += weights[k] * geometry.coordinates.at(corners[k])[axis];
    INFO("ray " << i << ", geometry " << hit.geometry << ", primitive " << hit.primitive);
    REQUIRE(at[0] == Approx(point[0]).margin(2e-4));
    REQUIRE(at[1] == Approx(point[1]).margin(2e-4));
    const auto& material = surfaces.materials.at(geometry.materials.at(hit.primitive));
    REQUIRE_THAT(material.name, Contains("'m" + std::to_string(static_cast<int>(point[2])) + "'"));
  }
  CHECK(found > rays.size() / 10);
}

/// The message about files that are not those of a BVH.
std::string misfit(const std::vector<std::string>& inputs, const build::Buffer& file) {
  const auto surfaces = tools::load_surfaces(inputs, view_of(file));
  if (surfaces) FAIL("accepted");
  CHECK(surfaces.error().code == build::ErrorCode::kInvalidInput);
  return surfaces.error().message;
}

std::string triangle_obj() { return "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"; }

}  // namespace

TEST_CASE("surfaces: numbers of triangles and corners are those of hits; flat, flattened and instanced") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const TempFolder folder;
    constexpr unsigned kNodes = 5;
    tools::BuildCommand command;
    command.inputs = {folder.write("a.glb", random_file(random, kNodes).glb()).string()};
    check_hits(command, random, kNodes);
    command.instances = true;
    check_hits(command, random, kNodes);
    command.flatten = true;
    check_hits(command, random, kNodes);
  }
}

TEST_CASE("surfaces: several files are geometries in their order, or objects; other formats get the clay material") {
  Random random(7);
  const TempFolder folder;
  GltfBuilder b = random_file(random, 2);
  tools::BuildCommand command;
  command.inputs = {folder.write("a.obj", kObj).string(), folder.write("b.glb", b.glb()).string(),
                    folder.write("c.obj", triangle_obj()).string()};
  const auto flat = surfaces_of(command);
  REQUIRE(flat.objects.size() == 1);
  REQUIRE(flat.objects[0].size() == 3);
  REQUIRE(flat.materials.size() == 4);  // Clay is made when it is needed first.
  CHECK(flat.materials[0].name == "clay");
  CHECK(flat.materials[0].base_color == std::array<float, 3>{0.80f, 0.775f, 0.745f});
  CHECK(flat.materials[0].metallic == 0);
  CHECK(flat.materials[0].roughness == 1);
  CHECK(flat.objects[0][0].materials == std::vector<std::uint32_t>{0, 0});
  CHECK(flat.objects[0][0].triangles == std::vector<build::Triangle>{{0, 1, 2}, {1, 3, 2}});
  CHECK(flat.objects[0][0].coordinates.empty());
  CHECK(flat.objects[0][0].normals.empty());
  CHECK(flat.objects[0][1].materials[0] == 1);
  CHECK(flat.objects[0][2].materials == std::vector<std::uint32_t>{0});
  command.instances = true;
  const auto instanced = surfaces_of(command);
  REQUIRE(instanced.objects.size() >= 3);
  CHECK(instanced.objects.front()[0].triangles.size() == 2);
  CHECK(instanced.objects.back()[0].triangles.size() == 1);
}

TEST_CASE("surfaces: scenes of JSON with groups, instanced and flattened") {
  const TempFolder folder;
  GltfBuilder b;
  b.json["materials"] = {{{"name", "green"}}};
  const int normals = b.add_positions({0, 0, 2, 0, 0, 2, 0, 0, 2});
  b.add_mesh(b.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  b.json["meshes"][0]["primitives"][0]["material"] = 0;
  b.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals;
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  folder.write("leaf.glb", b.glb());
  folder.write("trunk.obj", kObj);
  const json group = {{{"object", "tree"}}, {{"object", "tree"}, {"scale", {1, 1, -1}}, {"translate", {0, 0, 9}}}};
  const json document = {{"format", "hiprt scene"},
                         {"version", 1},
                         {"scene", "top"},
                         {"objects", {{"tree", {"trunk.obj", "leaf.glb"}}}},
                         {"groups", {{"grove", group}, {"top", {{{"object", "grove"}}}}}}};
  tools::BuildCommand command;
  command.inputs = {folder.write("scene.json", document.dump()).string()};
  const auto instanced = surfaces_of(command);
  REQUIRE(instanced.objects.size() == 2);  // The tree, and the grove, which has no geometries.
  REQUIRE(instanced.objects[0].size() == 2);
  CHECK(instanced.objects[1].empty());
  CHECK(instanced.objects[0][1].normals[2] == std::array<float, 3>{0, 0, 1});
  command.flatten = true;
  const auto flat = surfaces_of(command);
  REQUIRE(flat.objects.size() == 1);
  REQUIRE(flat.objects[0].size() == 4);
  CHECK(flat.objects[0][3].triangles == std::vector<build::Triangle>{{0, 2, 1}});
  CHECK(flat.objects[0][3].normals[0] == std::array<float, 3>{0, 0, -1});
  CHECK_THAT(flat.materials[flat.objects[0][3].materials[0]].name, Contains("'green'"));
  CHECK(flat.materials[flat.objects[0][2].materials[1]].name == "clay");
}

TEST_CASE("surfaces: binary scenes get the clay material") {
  const TempFolder folder;
  tools::BuildCommand command;
  const std::string bytes = SceneFile().triangle(0).triangle(1).group({{0, 0.f}, {1, 2.f}}).bytes();
  command.inputs = {folder.write("a.scene", bytes).string()};
  const auto surfaces = surfaces_of(command);
  REQUIRE(surfaces.objects.size() == 2);
  CHECK(surfaces.objects[1][0].materials == std::vector<std::uint32_t>{0});
  CHECK(surfaces.materials.size() == 1);
}

TEST_CASE("surfaces: meshes that deform have their materials, and normals at each time of the BVH") {
  const TempFolder folder;
  GltfBuilder b;
  b.json["materials"] = {{{"name", "skin"}}};
  b.add_mesh(b.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  json& primitive = b.json["meshes"][0]["primitives"][0];
  primitive["material"] = 0;
  primitive["attributes"]["NORMAL"] = b.add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
  primitive["attributes"]["TEXCOORD_0"] = b.add_accessor<float>({0, 0, 1, 0, 0, 1}, 5126, "VEC2", 3);
  primitive["targets"] = {{{"POSITION", b.add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1})},
                           {"NORMAL", b.add_positions({1, 0, -1, 1, 0, -1, 1, 0, -1})}}};
  b.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"weights", {0}}}};
  b.json["scenes"] = {{{"nodes", {0, 1}}}};
  b.animate(1, "weights", {0, 2}, {0, 1});
  tools::BuildCommand command;
  command.inputs = {folder.write("a.glb", b.glb()).string()};
  command.instances = true;
  command.shutter = "0,2";
  command.motion_keys = 3;
  const build::Buffer file = build_inputs(command);
  const auto surfaces = value_of(tools::load_surfaces(command.inputs, view_of(file)));
  REQUIRE((surfaces.objects.size() == 2 && surfaces.objects[0].size() == 1 && surfaces.objects[1].size() == 1));
  CHECK(surfaces.objects[0][0].times.empty());
  const tools::GeometrySurface& skin = surfaces.objects[1][0];
  CHECK(skin.times == std::vector<float>{0, 1, 2});
  CHECK((skin.triangles.size() == 1 && skin.materials.size() == 1 && !skin.shape_material));
  CHECK(surfaces.materials.at(skin.materials[0]).name.ends_with("'skin'"));
  CHECK(skin.coordinates.size() == 3);
  REQUIRE(skin.normals.size() == 9);
  CHECK(skin.normals[2] == std::array<float, 3>{0, 0, 1});
  CHECK(skin.normals[3][0] == Approx(std::sqrt(0.5f)));
  CHECK(skin.normals[3][2] == Approx(std::sqrt(0.5f)));
  CHECK(skin.normals[8] == std::array<float, 3>{1, 0, 0});

  const std::string other = folder.write("one.obj", triangle_obj()).string();
  CHECK_THAT(misfit({other, other}, file),
             Contains("one.obj: object 1, geometry 0 has 1 triangles, that of the BVH 1 moving triangles"));
}

TEST_CASE("surfaces: spheres and curves are geometries of clay behind the meshes") {
  const TempFolder folder;
  const std::string hair = folder.write("a.hair", HairFile{}.bytes()).string(),
                    balls = folder.write("b.xyzr", "0 0 0 1\n3 0 0 1\n").string(),
                    mesh = folder.write("two.obj", kObj).string();
  const auto is_shapes = [](const tools::SceneSurfaces& surfaces, const tools::GeometrySurface& geometry,
                            std::uint64_t count) {
    return geometry.triangles.empty() && geometry.primitives() == count && geometry.shape_material &&
           surfaces.materials.at(*geometry.shape_material).name == "clay";
  };
  tools::BuildCommand command;
  command.inputs = {hair, mesh, balls};
  const auto flat = surfaces_of(command);
  REQUIRE(flat.objects.size() == 1);
  REQUIRE(flat.objects[0].size() == 3);
  CHECK(flat.objects[0][0].primitives() == 2);
  CHECK_FALSE(flat.objects[0][0].shape_material);
  CHECK(is_shapes(flat, flat.objects[0][1], 3));
  CHECK(is_shapes(flat, flat.objects[0][2], 2));
  CHECK(flat.materials.size() == 1);
  command.instances = true;
  const auto instanced = surfaces_of(command);
  REQUIRE(instanced.objects.size() == 3);
  CHECK(is_shapes(instanced, instanced.objects[0][0], 3));
  CHECK(instanced.objects[1][0].triangles.size() == 2);
  CHECK(is_shapes(instanced, instanced.objects[2][0], 2));
  command.instances = false;
  const json document = {{"format", "hiprt scene"},
                         {"version", 1},
                         {"scene", "top"},
                         {"objects", {{"all", {{{"spheres", {{0, 0, 5, 1}}}}, "two.obj", "a.hair"}}}},
                         {"groups", {{"top", {{{"object", "all"}}}}}}};
  command.inputs = {folder.write("scene.json", document.dump()).string()};
  const auto described = surfaces_of(command);
  REQUIRE(described.objects[0].size() == 3);
  CHECK(described.objects[0][0].triangles.size() == 2);
  CHECK(is_shapes(described, described.objects[0][1], 1));
  CHECK(is_shapes(described, described.objects[0][2], 3));

  command.inputs = {balls};
  const build::Buffer file = build_inputs(command);
  CHECK(misfit({hair}, file) == "a.hair: geometry 0 has 3 shapes, that of the BVH 2 shapes");
  CHECK(misfit({mesh}, file) == "two.obj: geometry 0 has 2 triangles, that of the BVH 2 shapes");
  const auto refused = tools::load_surfaces(command.inputs, view_of(file), balls);
  REQUIRE(!refused);
  CHECK_THAT(refused.error().message, Contains("the output is one of the inputs"));
}

TEST_CASE("surfaces: files that do not match the BVH are refused with the numbers") {
  Random random(8);
  const TempFolder folder;
  const std::string two = folder.write("two.obj", kObj).string(),
                    one = folder.write("one.obj", triangle_obj()).string(),
                    glb = folder.write("a.glb", random_file(random, 3).glb()).string();
  tools::BuildCommand command;
  command.inputs = {two};
  const build::Buffer flat = build_inputs(command);
  CHECK(misfit({one}, flat) == "one.obj: geometry 0 has 1 triangles, that of the BVH 2 triangles");
  CHECK(misfit({two, one}, flat) == two + " and the other files make 2 geometries, that of the BVH 1");
  CHECK_THAT(misfit({}, flat), Contains("0 files"));
  CHECK_THAT(misfit({one, "a.json"}, flat), Contains("a.json is a scene, which has to be the only file; there are 2"));
  command.inputs = {two, one};
  command.instances = true;
  const build::Buffer instanced = build_inputs(command);
  CHECK(misfit({two}, instanced) == two + " makes 1 objects, the BVH has 2");
  CHECK(misfit({one, two}, instanced) == "one.obj: object 0, geometry 0 has 1 triangles, that of the BVH 2 triangles");
  CHECK_THAT(misfit({glb}, flat), Contains("a.glb: geometry 0 has") && Contains("that of the BVH 2"));
  CHECK_THAT(misfit({folder.write("b.json", "{}").string()}, flat), Contains("b.json"));
}

TEST_CASE("surfaces: the output file must not be an input file") {
  const TempFolder folder;
  const std::string one = folder.write("one.obj", triangle_obj()).string();
  tools::BuildCommand command;
  command.inputs = {one};
  const build::Buffer file = build_inputs(command);
  const auto refused = tools::load_surfaces(command.inputs, view_of(file), one);
  REQUIRE(!refused);
  CHECK_THAT(refused.error().message, Contains("the output is one of the inputs"));
  CHECK(tools::load_surfaces(command.inputs, view_of(file), (folder / "new.png").string()));
}
