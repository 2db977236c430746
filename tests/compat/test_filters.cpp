// Filter functions: geometry types, ray types, tables, payloads, and triangles.

#include <tests/compat/scenes.h>
#include <tests/compat/types.h>

using namespace hiprt;
using namespace hiprt::test;

TEST_CASE("a filter decides on each triangle, and sees the whole hit") {
  INFO("seed " << kSeed);
  Random random(kSeed + 10);
  for (const build::Builder builder : {build::Builder::kSah, build::Builder::kHq}) {
    const Triangles scene(random, 200, {.builder = builder}, 0.8f);
    set_type(scene.view(), 2);
    const SceneView view = scene.view();
    const hiprtGeometry geometry = geometry_handle(&view);
    Table table(4, 2);
    for (unsigned i = 0; i < 100; ++i) {
      CAPTURE(i);
      hiprtRay ray = random_ray(random);
      if (i % 2 == 1) ray.minT = random.uniform_float(0, 1);
      const auto own = own_hits<Policies>(view, own_ray(ray));
      const auto accepts = [](const auto& hit) { return (hit.primID & 1u) == 0 && hit.uv.x < 0.5f; };
      Program program;
      bool closest = true;
      float limit = hiprt::FltMax;
      program.filter = [&](const Call& call, const hiprtHit& hit) {
        CHECK(call.geom_type == 2u);
        CHECK(call.ray_type == 1u);
        CHECK(call.header.numGeomTypes == 4u);
        CHECK(call.header.numRayTypes == 2u);
        CHECK(call.header.funcDataSets == table.sets.data());
        CHECK(call.ray.origin == ray.origin);
        CHECK(call.ray.direction == ray.direction);
        CHECK(call.ray.minT == ray.minT);
        CHECK(call.ray.maxT == limit);
        CHECK(hit.t >= ray.minT);
        CHECK(hit.t <= limit);
        CHECK(hit.instanceID == hiprtInvalidValue);
        check_normal(hit, scene.normal(hit.primID));
        const bool accepted = accepts(hit);
        if (accepted && closest) limit = hit.t;
        return !accepted;
      };
      std::vector<hiprtHit> expected;
      for (const Hit& hit : own) {
        hiprtHit same = compat_detail::no_hit();
        same.primID = hit.primitive;
        same.uv = {hit.u, hit.v};
        same.t = hit.t;
        if (accepts(same)) expected.push_back(same);
      }
      const hiprtHit hit =
          hiprtGeomTraversalClosest(geometry, ray, hiprtTraversalHintDefault, &program, table.handle(), 1).getNextHit();
      REQUIRE(hit.hasHit() == !expected.empty());
      for (const hiprtHit& other : expected) CHECK(hit.t <= other.t);
      closest = false;
      limit = hiprt::FltMax;
      std::vector<std::uint32_t> found, wanted;
      for (const hiprtHit& any :
           all_hits(hiprtGeomTraversalAnyHit(geometry, ray, hiprtTraversalHintDefault, &program, table.handle(), 1)))
        found.push_back(any.primID);
      for (const hiprtHit& other : expected) wanted.push_back(other.primID);
      std::sort(found.begin(), found.end());
      found.erase(std::unique(found.begin(), found.end()), found.end());
      std::sort(wanted.begin(), wanted.end());
      CHECK(found == wanted);
    }
  }
}

TEST_CASE("trap: when filters are called") {
  const Triangles triangles(Corners{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  const Spheres spheres(Points{{{0.25f, 0.25f, 3}, 1}});
  const hiprtRay ray = make_ray({0.25f, 0.25f, 0}, {0, 0, 1});
  Table table(2, 1);
  unsigned intersects = 0, filters = 0;
  Program program;
  std::uint32_t seen_type = 0;
  program.intersect = [&](const Call& call, hiprtHit& hit) {
    ++intersects;
    seen_type = call.geom_type;
    return intersect_sphere(call.ray, spheres.spheres[hit.primID], hit);
  };
  program.filter = [&](const Call&, const hiprtHit&) { return ++filters != 0; };
  const auto hits_triangle = [&](std::uint32_t type, bool with_table) {
    set_type(triangles.view(), type);
    const SceneView view = triangles.view();
    filters = 0;
    return hiprtGeomTraversalClosest(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program,
                                     with_table ? table.handle() : nullptr)
        .getNextHit()
        .hasHit();
  };
  const auto hits_sphere = [&](std::uint32_t type, bool with_table) {
    set_type(spheres.view(), type);
    const SceneView view = spheres.view();
    intersects = filters = 0;
    const bool hit = hiprtGeomCustomTraversalClosest(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program,
                                                     with_table ? table.handle() : nullptr)
                         .getNextHit()
                         .hasHit();
    CHECK(intersects == 1);
    CHECK(seen_type == type);
    return hit;
  };
  CHECK(hits_triangle(hiprtInvalidValue, true));
  CHECK(filters == 0);
  CHECK(hits_triangle(1, false));
  CHECK(filters == 0);
  CHECK_FALSE(hits_triangle(1, true));
  CHECK(filters == 1);
  CHECK(hits_sphere(hiprtInvalidValue, true));
  CHECK(filters == 0);
  CHECK(hits_sphere(1, false));
  CHECK(filters == 0);
  CHECK_FALSE(hits_sphere(1, true));
  CHECK(filters == 1);
}

TEST_CASE("trap: split triangles may come twice, and a filter with a payload drops repeats") {
  INFO("seed " << kSeed);
  Random random(kSeed + 11);
  const Triangles scene(random, 100, {.builder = build::Builder::kSbvh, .split_budget = 4.0}, 1.5f);
  set_type(scene.view(), 0);
  const SceneView view = scene.view();
  REQUIRE((view.features & feature_bit(Feature::kSplitReferences)) != 0);
  Table table(1, 1);
  for (unsigned i = 0; i < 100; ++i) {
    CAPTURE(i);
    const hiprtRay ray = random_ray(random);
    std::vector<bool> seen(100);
    Program program;
    program.filter = [&](const Call&, const hiprtHit& hit) {
      const bool again = seen[hit.primID];
      seen[hit.primID] = true;
      return again;
    };
    const auto hits = all_hits(
        hiprtGeomTraversalAnyHit(geometry_handle(&view), ray, hiprtTraversalHintDefault, &program, table.handle()));
    CHECK(hits.size() == own_hits<Policies>(view, own_ray(ray)).size());
  }
}

TEST_CASE("data sets are those of both types") {
  const Triangles scene(Corners{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  set_type(scene.view(), 2);
  const SceneView view = scene.view();
  Table table(3, 2);
  int data[6] = {};
  for (std::size_t i = 0; i < 6; ++i) table.sets[i].filterFuncData = &data[i];
  Program program;
  const void* got = nullptr;
  program.filter = [&](const Call& call, const hiprtHit&) {
    got = call.header.funcDataSets[call.header.numGeomTypes * call.ray_type + call.geom_type].filterFuncData;
    return false;
  };
  for (const std::uint32_t ray_type : {0u, 1u}) {
    hiprtGeomTraversalClosest(geometry_handle(&view), make_ray({0.25f, 0.25f, 0}, {0, 0, 1}), hiprtTraversalHintDefault,
                              &program, table.handle(), ray_type)
        .getNextHit();
    CHECK(got == &data[3 * ray_type + 2]);
  }
}
