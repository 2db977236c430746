// Runs the kernels of the pages in hiprt_device/docs on the host and compares their results with brute force.

#include <tests/examples/test_worlds.h>

#include <memory>

#include "all_hits.hip"
#include "batch.hip"
#include "blockers.hip"
#include "closest_hit.hip"
#include "closest_points.hip"
#include "cut_out.hip"
#include "distance_field.hip"
#include "global_stack.hip"
#include "inside.hip"
#include "layers.hip"
#include "policies.hip"
#include "primitive_list.hip"
#include "primitive_table.hip"
#include "ray_instruction.hip"
#include "restart_stack.hip"
#include "rolling_stack_host.hip"
#include "shadow.hip"
#include "spheres_and_curves_host.hip"
#include "tiered_stack.hip"
#include "voxels.hip"

using namespace hiprt;
using namespace hiprt::checks;
using namespace hiprt::examples;

TEST_CASE("examples of closest hits, with every kind of stack", "[examples]") {
  const World world;
  const Scene built = make_scene(world.meshes);
  const SceneView& scene = built.traced;
  std::vector<Hit> hits(kCount);
  const Ray* rays = world.rays.data();
  SECTION("one call") { start(closest_hits, scene, rays, hits.data(), kCount); }
  SECTION("rolling") { CHECK(launch_rolling(scene, rays, hits.data(), kCount) == 0); }
  SECTION("restart") { start(trace_restarting, scene, rays, hits.data(), kCount); }
  SECTION("tiered") { start(trace_tiered, scene, rays, hits.data(), kCount); }
  SECTION("global") {
    SpillPool pool{nullptr, nullptr, 3, 0};
    std::vector<StackEntry> memory(global_stack_bytes(scene, pool.slots, 1, pool.entries) / sizeof(StackEntry));
    std::vector<std::uint32_t> locks(pool.slots, 0);
    pool.locks = locks.data();
    pool.memory = memory.data();
    start(trace_global, scene, rays, hits.data(), kCount, pool);
    CHECK(locks == std::vector<std::uint32_t>(3, 0));
  }
  SECTION("persistent") {
    unsigned next = 0, overflows = 0;
    start(trace_persistent, scene, rays, hits.data(), kCount, &next, &overflows);
    CHECK(next >= kCount);
    CHECK(overflows == 0);
  }
  check_hits(hits, world.expected);
}

TEST_CASE("the example of policies takes the smallest set that covers the scene", "[examples]") {
  World world;
  std::vector<Hit> hits(kCount);
  const Scene lean = make_scene(world.meshes, {.nodes = NodeLayout::kQuantized});
  REQUIRE(launch_smallest(lean.traced, world.rays.data(), hits.data(), kCount));
  check_hits(hits, world.expected);
  CHECK_FALSE(launch_smallest(make_scene(world.meshes).traced, world.rays.data(), hits.data(), kCount));
  world.meshes[0].mask = 6;
  for (Ray& ray : world.rays) ray.mask = 8;
  const Scene full = make_scene(world.meshes, {.nodes = NodeLayout::kQuantized});
  CHECK_FALSE(covers<Lean>(full.traced));
  REQUIRE(launch_smallest(full.traced, world.rays.data(), hits.data(), kCount));
  CHECK(std::any_of(hits.begin(), hits.end(), [](const Hit& hit) { return hit.found(); }));
  CHECK(std::none_of(hits.begin(), hits.end(), [](const Hit& hit) { return hit.geometry == 0; }));
}

TEST_CASE("the example of shadows: a closed mesh is lit where its normal is to the light", "[examples]") {
  const World world;
  const Scene scene = make_scene({icosphere(2)});
  std::vector<Hit> hits(kCount);
  for (unsigned i = 0; i < kCount; ++i) hits[i] = closest_hit(scene.traced, world.rays[i]);
  const Vec3 light(0, 0, 5);
  std::array<bool, kCount> lit{};
  start(shadows, scene.traced, world.rays.data(), hits.data(), light, lit.data(), kCount);
  unsigned lights = 0, dark = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    const Ray& ray = world.rays[i];
    const Vec3 to_light = light - (ray.origin + hits[i].t * ray.direction);
    // From inside a point is spawned on the side of its light, which is outside.
    const float cosine = glm::dot(glm::normalize(hits[i].normal), glm::normalize(to_light));
    if (hits[i].found() && std::abs(cosine) < 1e-3f) continue;
    CAPTURE(i, cosine);
    REQUIRE(lit[i] == (hits[i].found() && cosine > 0));
    (lit[i] ? lights : dark) += hits[i].found() ? 1 : 0;
  }
  CHECK(lights > kCount / 10);
  CHECK(dark > kCount / 10);
}

TEST_CASE("the example of closest points", "[examples]") {
  const Scene scene = make_scene({icosphere(4)});
  Random random(kSeed + 9);
  std::vector<Vec3> points(kCount);
  for (Vec3& point : points) point = vec3(random.in_cube(3));
  std::vector<float> distances(kCount);
  start(closest_points, scene.traced, points.data(), distances.data(), kCount);
  for (unsigned i = 0; i < kCount; ++i)  // The mesh is inside the unit sphere, by less than 0.005.
    REQUIRE(std::abs(distances[i] - std::abs(glm::length(points[i]) - 1.0f)) < 0.005f);
}

TEST_CASE("the example of a distance field", "[examples]") {
  const Scene scene = make_scene({icosphere(4)}, {.nodes = NodeLayout::kQuantized});
  constexpr unsigned kSide = 7;
  std::vector<float> distances(kSide * kSide * kSide);
  start(distance_field, scene.traced, Vec3(-1.5f), 0.5f, kSide, distances.data());
  for (unsigned i = 0; i < distances.size(); ++i) {
    const unsigned x = i % kSide, y = i / kSide % kSide, z = i / (kSide * kSide);
    const Vec3 at = Vec3(-1.5f) + 0.5f * Vec3(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    REQUIRE(std::abs(distances[i] - (glm::length(at) - 1.0f)) < 0.005f);
  }
}

TEST_CASE("the example of voxels", "[examples]") {
  const Mesh mesh = grid_plane(4, 2, 0.0f);
  const Scene scene = make_scene({mesh});
  std::vector<Box> boxes(kCount);
  Random random(kSeed + 10);
  for (Box& box : boxes) {
    const Position p = random.in_cube(1);
    box = {{p[0], p[1], p[2]}, {p[0] + 1e-3f, p[1] + 1e-3f, p[2] + 0.5f}};
  }
  std::vector<unsigned> counts(kCount);
  start(count_in_boxes, scene.traced, boxes.data(), counts.data(), kCount);
  for (unsigned i = 0; i < kCount; ++i) {
    unsigned expected = 0;
    for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
      const Corners c = corners(mesh, k);
      const Vec3 corner[3] = {vec3(c.p0), vec3(c.p1), vec3(c.p2)};
      expected += box_meets_triangle(boxes[i], corner) ? 1 : 0;
    }
    REQUIRE(counts[i] == expected);
  }
}

TEST_CASE("the example of a cut-out", "[examples]") {
  const World world;
  const Scene scene = make_scene(world.meshes);
  const Mesh& mesh = world.meshes[0];
  Random random(kSeed + 3);
  std::vector<std::array<float, 2>> uv(mesh.positions.size());
  for (auto& at : uv) at = {random.uniform_float(0, 0.99), random.uniform_float(0, 0.99)};
  std::vector<float> alpha(16 * 16);
  for (float& texel : alpha) texel = random.uniform_float(0, 1);
  const CutOut filter{reinterpret_cast<const unsigned(*)[3]>(mesh.triangles.data()),
                      reinterpret_cast<const float(*)[2]>(uv.data()), alpha.data(), 16};
  std::vector<Hit> hits(kCount), expected(kCount);
  start(trace_cut_out, scene.traced, world.rays.data(), hits.data(), kCount, filter);
  unsigned behind = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    const auto left = kept(every_hit(world.meshes, world.rays[i]),
                           [&](const Hit& hit) { return filter(world.rays[i], hit) == FilterResult::kAccept; });
    if (!left.empty()) expected[i] = left[0];
    behind += same_hit(expected[i], world.expected[i]) ? 0 : 1;
  }
  check_hits(hits, expected);
  CHECK(behind > kCount / 10);
}

TEST_CASE("the example of all hits", "[examples]") {
  const World world;
  const float passes[] = {0.5f, 0.25f};
  for (const build::Builder builder : typical_builders()) {
    const Scene scene = make_scene(world.meshes, {.builder = builder});
    std::vector<float> light(kCount);
    start(transmittance, scene.traced, world.rays.data(), passes, light.data(), kCount);
    for (unsigned i = 0; i < kCount; ++i) {
      float expected = 1;
      for (const Hit& hit : every_hit(world.meshes, world.rays[i])) expected *= passes[hit.geometry];
      REQUIRE(light[i] == expected);
    }
  }
  const Scene other = make_scene(world.meshes, {.nodes = NodeLayout::kFloat});
  std::vector<float> light(kCount);
  start(transmittance, other.traced, world.rays.data(), passes, light.data(), kCount);
  CHECK(light == std::vector<float>(kCount, -1.0f));
}

TEST_CASE("the example of custom primitives", "[examples]") {
  const World world;
  const RoundWorld round(world.meshes, true);
  const Shapes shapes{{round.rounds[0].data()}, {round.rounds[1].data()}};
  std::vector<Hit> hits(kCount), expected(kCount);
  start(trace_shapes, round.scene, world.rays.data(), hits.data(), kCount, shapes);
  unsigned of_geometry[4] = {};
  for (unsigned i = 0; i < kCount; ++i) {
    expected[i] = round.closest(world.meshes, world.rays[i], shapes);
    if (expected[i].found()) ++of_geometry[expected[i].geometry];
  }
  check_hits(hits, expected);
  for (const unsigned geometry : {0u, 1u, 2u, 3u}) CHECK(of_geometry[geometry] > 20);
}

TEST_CASE("the example of ray types", "[examples]") {
  const World world;
  const RoundWorld round({}, false);
  const Balls opaque{round.rounds[0].data()}, glass{round.rounds[1].data()};
  std::vector<unsigned> types(kCount);
  for (unsigned i = 0; i < kCount; ++i) types[i] = i % 2;
  std::array<bool, kCount> met{};
  start(trace_types, round.scene, world.rays.data(), types.data(), met.data(), kCount, opaque, glass);
  unsigned differ = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    const bool all = round.closest({}, world.rays[i], PrimitiveList{opaque, glass}).found();
    const bool some = round.closest({}, world.rays[i], PrimitiveList{opaque}).found();
    REQUIRE(met[i] == (types[i] == 0 ? all : some));
    differ += all != some ? 1 : 0;
  }
  CHECK(differ > kCount / 10);
}

TEST_CASE("the example of spheres and curves", "[examples]") {
  const World world;
  const HairWorld hair;
  const auto bvh = build_spheres_and_curves(hair.spheres, hair.vertices, hair.first_vertex);
  REQUIRE(bvh.has_value());
  const SceneView scene = make_scene_view(*open_buffer(bvh->buffer.bytes()));
  std::vector<Hit> hits(kCount), expected(kCount);
  launch_spheres_and_curves(scene, world.rays.data(), hits.data(), kCount, hair.spheres.data(), hair.vertices.data(),
                            hair.first_vertex.data());
  const SpheresAndCurves primitives{{hair.spheres.data()}, {hair.vertices.data(), hair.first_vertex.data()}};
  unsigned of_geometry[2] = {};
  for (unsigned i = 0; i < kCount; ++i) {
    std::vector<Hit> all;
    add_custom_hits(world.rays[i], primitives, 0, 0, hair.spheres.size(), all);
    add_custom_hits(world.rays[i], primitives, 1, 1, hair.first_vertex.size(), all);
    expected[i] = first_of(std::move(all));
    if (expected[i].found()) ++of_geometry[expected[i].geometry];
  }
  check_hits(hits, expected);
  for (const unsigned found : of_geometry) CHECK(found > kCount / 10);
}

TEST_CASE("the example of the ray instruction, on machines without it", "[examples]") {
  const World world;
  const Scene scene = make_scene(world.meshes, {.nodes = NodeLayout::kFloat}), other = make_scene(world.meshes);
  for (const auto kernel : {trace_boxes_in_hardware, trace_all_in_hardware}) {
    std::vector<Hit> hits(kCount);
    start(kernel, scene.traced, world.rays.data(), hits.data(), kCount);
    check_hits(hits, world.expected);
    start(kernel, other.traced, world.rays.data(), hits.data(), kCount);
    CHECK(std::all_of(hits.begin(), hits.end(), [](const Hit& hit) { return hit.failed(); }));
  }
}

TEST_CASE("the example of layers", "[examples]") {
  const World world;
  for (const build::Builder builder : typical_builders()) {
    const Scene scene = make_scene(world.meshes, {.builder = builder});
    std::vector<Hit> layers(kLayers * kCount);
    std::vector<unsigned> found(kCount);
    start(first_layers, scene.traced, world.rays.data(), layers.data(), found.data(), kCount);
    unsigned of_number[kLayers + 1] = {};
    for (unsigned i = 0; i < kCount; ++i) {
      const auto all = every_hit(world.meshes, world.rays[i]);
      REQUIRE(found[i] == std::min<std::size_t>(kLayers, all.size()));
      for (unsigned k = 0; k < found[i]; ++k) REQUIRE(same_hit(layers[kLayers * i + k], all[k]));
      ++of_number[found[i]];
    }
    for (const unsigned rays : of_number) CHECK(rays > kCount / 20);
  }
  std::vector<Hit> layers(kLayers * kCount);
  std::vector<unsigned> found(kCount);
  const Scene other = make_scene(world.meshes, {.nodes = NodeLayout::kFloat});
  start(first_layers, other.traced, world.rays.data(), layers.data(), found.data(), kCount);
  CHECK(found == std::vector<unsigned>(kCount, ~0u));
}

TEST_CASE("the example of blockers", "[examples]") {
  const World world;
  // Below split references a triangle would block twice.
  const Scene scene = make_scene(world.meshes, {.builder = build::Builder::kSah}),
              other = make_scene(world.meshes, {.builder = build::Builder::kSah, .nodes = NodeLayout::kFloat});
  Random random(kSeed + 6);
  std::vector<Ray> rays(kCount);
  for (unsigned i = 0; i < kCount; ++i) {
    const Hit& start = world.expected[i];
    rays[i].origin = world.rays[i].origin + (start.found() ? start.t : 0.0f) * world.rays[i].direction;
    rays[i].direction = vec3(random.in_cube(1));
  }
  std::vector<unsigned> blockers(kCount);
  start(count_blockers, scene.traced, rays.data(), world.expected.data(), blockers.data(), kCount);
  unsigned of_number[kMostBlockers + 1] = {}, starts_met = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    const ExceptPrimitive except{world.expected[i].geometry, world.expected[i].primitive};
    const auto all = every_hit(world.meshes, rays[i]);
    const auto others = kept(all, [&](const Hit& hit) { return except(rays[i], hit) == FilterResult::kAccept; });
    REQUIRE(blockers[i] == std::min<std::size_t>(kMostBlockers, others.size()));
    ++of_number[blockers[i]];
    starts_met += all.size() != others.size() ? 1 : 0;
  }
  for (const unsigned count : of_number) CHECK(count > kCount / 50);
  CHECK(starts_met > kCount / 20);
  start(count_blockers, other.traced, rays.data(), world.expected.data(), blockers.data(), kCount);
  CHECK(blockers == std::vector<unsigned>(kCount, ~0u));
}

TEST_CASE("the example of exact decisions: lines through grid points pass through edges and corners", "[examples]") {
  // A cube of quads, twelve by twelve on a side, from -6 to 6.
  Mesh cube = subdivided_box(12, 1.0, kSeed);
  for (Position& p : cube.positions)
    for (float& x : p) x = std::round(6.0f * x);
  REQUIRE(is_closed(cube));
  const Scene built = make_scene({cube}, {.nodes = NodeLayout::kPlanes});
  std::vector<Vec3> points;
  for (unsigned i = 0; i < kCount; ++i) {
    const auto coordinate = [&](unsigned step) { return static_cast<float>(2 * (i / step % 10)) - 9.0f; };
    points.emplace_back(coordinate(1), coordinate(10), coordinate(100));
  }
  const auto inside = std::make_unique<bool[]>(kCount);
  start(find_inside, built.traced, points.data(), inside.get(), kCount);
  for (unsigned i = 0; i < kCount; ++i) {
    INFO(points[i].x << " " << points[i].y << " " << points[i].z);
    REQUIRE(inside[i] == (max_component(points[i]) < 6.0f));
  }
}
