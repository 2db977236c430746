// Against Embree 3.13 in robust mode on the same meshes. Where the two disagree, the exact oracle decides, and it must
// decide for us.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <embree3/rtcore.h>
#include <catch2/catch.hpp>

#include <cstring>
#include <memory>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 5;

template <auto release> struct Release {
  template <class T> void operator()(T* object) const { release(object); }
};
using Device = std::unique_ptr<RTCDeviceTy, Release<rtcReleaseDevice>>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, Release<rtcReleaseScene>>;

EmbreeScene embree_scene(RTCDevice device, const Mesh& mesh) {
  EmbreeScene scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Position),
                                            mesh.positions.size());
  std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(Position));
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle),
                                            mesh.triangles.size());
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.get());
  REQUIRE(rtcGetDeviceError(device) == RTC_ERROR_NONE);
  return scene;
}

RTCRay embree_ray(const Ray& ray) {
  RTCRay r{};
  r.org_x = ray.origin.x, r.org_y = ray.origin.y, r.org_z = ray.origin.z, r.tnear = ray.tmin;
  r.dir_x = ray.direction.x, r.dir_y = ray.direction.y, r.dir_z = ray.direction.z, r.tfar = ray.tmax;
  r.mask = 0xffffffffu;
  return r;
}

Hit embree_closest(RTCScene scene, const Ray& ray) {
  RTCRayHit both{embree_ray(ray), {}};
  both.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &both);
  Hit hit;
  if (both.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.t = both.ray.tfar;
  hit.u = both.hit.u;
  hit.v = both.hit.v;
  hit.geometry = 0;
  hit.primitive = both.hit.primID;
  return hit;
}

bool embree_any(RTCScene scene, const Ray& ray) {
  RTCRay r = embree_ray(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &r);
  return r.tfar == -std::numeric_limits<float>::infinity();
}

struct Case {
  std::string name;
  Mesh mesh;
};

std::vector<Case> cases() {
  std::vector<Case> result;
  for (Closed& closed : closed_meshes()) result.push_back({closed.name, std::move(closed.mesh)});
  result.push_back({"soup", soup(20000, 0.05, 2)});
  result.push_back({"needles 1e6", needles(2000, 1e6, 3)});
  result.push_back({"plane", grid_plane(40, 1, 0.3f)});
  return result;
}

/// Counts of one mesh.
struct Agreement {
  std::uint64_t rays = 0, hits = 0, other_primitive = 0, only_ours = 0, only_theirs = 0, any_differs = 0;
  double worst_t = 0;  ///< Relative difference of t, of hits on the same primitive.
  Comparison decided{};
};

Ray random_ray(const Mesh& mesh, Random& random) {
  Ray ray;
  ray.origin = vec3(random.in_cube(1.5));
  const Position to = random.below(3) == 0 ? random.in_cube(1) : rounded(target_point(mesh, random));
  ray.direction = vec3(to) - ray.origin;
  return ray;
}

void compare_one(const Mesh& mesh, const Scene& scene, RTCScene embree, const Ray& ray, Agreement& agreement) {
  const Hit ours = default_tracer().closest(scene, ray), theirs = embree_closest(embree, ray);
  ++agreement.rays;
  agreement.hits += ours.found() ? 1 : 0;
  agreement.any_differs += default_tracer().any(scene, ray).found() != embree_any(embree, ray) ? 1 : 0;
  if (!ours.found() && !theirs.found()) return;
  if (ours.primitive == theirs.primitive) {
    agreement.worst_t = std::max(agreement.worst_t, std::abs(double{ours.t} - theirs.t) / std::max(1e-6f, ours.t));
    return;
  }
  agreement.other_primitive += ours.found() && theirs.found() ? 1 : 0;
  agreement.only_ours += theirs.found() ? 0 : 1;
  agreement.only_theirs += ours.found() ? 0 : 1;
  compare(std::span(&mesh, 1), ray, ours, kBounds, agreement.decided);
}

}  // namespace

TEST_CASE("Embree's robust mode agrees, or the exact oracle decides for us", "[embree]") {
  INFO("seed " << kSeed);
  const Device device(rtcNewDevice("threads=2"));
  REQUIRE(device);
  std::printf("%-14s %8s %8s %8s %10s %12s %8s %10s\n", "mesh", "rays", "hits", "other", "only ours", "only Embree",
              "any", "worst t");
  for (const Case& test : cases()) {
    CAPTURE(test.name);
    const Scene scene = make_scene({test.mesh});
    const EmbreeScene embree = embree_scene(device.get(), test.mesh);
    Random random(kSeed);
    Agreement a;
    for (unsigned i = 0; i < trials(60000); ++i)
      compare_one(test.mesh, scene, embree.get(), random_ray(test.mesh, random), a);
    std::printf("%-14s %8lu %8lu %8lu %10lu %12lu %8lu %10.2g\n", test.name.c_str(), a.rays, a.hits, a.other_primitive,
                a.only_ours, a.only_theirs, a.any_differs, a.worst_t);
    INFO(a.decided.first_unexplained);
    CHECK(a.decided.unexplained == 0);
    CHECK(a.hits > a.rays / 50);
    CHECK(a.any_differs <= a.only_ours + a.only_theirs + a.rays / 1000);
  }
}
