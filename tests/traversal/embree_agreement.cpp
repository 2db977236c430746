#include <tests/traversal/embree_agreement.h>
#include <tests/traversal/tracers.h>

#include <embree3/rtcore.h>
#include <catch2/catch.hpp>

#include <cstring>
#include <memory>

namespace hiprt::checks {
namespace {

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

/// Counts of one mesh.
struct Agreement {
  std::uint64_t rays = 0, hits = 0, other_primitive = 0, only_ours = 0, only_theirs = 0, any_differs = 0;
  std::uint64_t inconsistent = 0;  ///< Our any hit says other than our closest hit.
  double worst_t = 0;              ///< Relative difference of t, of hits on the same primitive.
  double worst_point = 0;          ///< Distance of our point from that primitive, in eps * D.
  Comparison decided{};
};

void compare_one(const Mesh& mesh, const Scene& scene, RTCScene embree, const Ray& ray, Agreement& agreement) {
  const Hit ours = default_tracer().closest(scene, ray), theirs = embree_closest(embree, ray);
  const bool any = default_tracer().any(scene, ray).found(), any_differs = any != embree_any(embree, ray);
  ++agreement.rays;
  agreement.hits += ours.found() ? 1 : 0;
  agreement.any_differs += any_differs ? 1 : 0;
  agreement.inconsistent += any != ours.found() ? 1 : 0;
  if (ours.primitive == theirs.primitive && !any_differs) {
    if (!ours.found()) return;
    agreement.worst_t = std::max(agreement.worst_t, std::abs(double{ours.t} - theirs.t) / std::max(1e-6f, ours.t));
    agreement.worst_point = std::max(agreement.worst_point, point_distance(ray, corners(mesh, ours.primitive), ours.t));
    return;
  }
  agreement.other_primitive += ours.found() && theirs.found() ? 1 : 0;
  agreement.only_ours += theirs.found() || !ours.found() ? 0 : 1;
  agreement.only_theirs += ours.found() || !theirs.found() ? 0 : 1;
  compare(std::span(&mesh, 1), ray, ours, kBounds, agreement.decided);
}

}  // namespace

void print_agreement_header() {
  std::printf("%-14s %8s %8s %8s %10s %12s %8s %10s %8s\n", "mesh", "rays", "hits", "other", "only ours", "only Embree",
              "any", "worst t", "point");
}

void check_agreement(const std::string& name, const Mesh& mesh, const std::function<Ray(Random&)>& random_ray,
                     unsigned rays, std::uint64_t seed) {
  INFO(name << ", seed " << seed);
  const Device device(rtcNewDevice("threads=2"));
  REQUIRE(device);
  const Scene scene = make_scene({mesh});
  const EmbreeScene embree = embree_scene(device.get(), mesh);
  Random random(seed);
  Agreement a;
  for (unsigned i = 0; i < rays; ++i) compare_one(mesh, scene, embree.get(), random_ray(random), a);
  std::printf("%-14s %8lu %8lu %8lu %10lu %12lu %8lu %10.2g %8.2f\n", name.c_str(), a.rays, a.hits, a.other_primitive,
              a.only_ours, a.only_theirs, a.any_differs, a.worst_t, a.worst_point);
  INFO(a.decided.first_unexplained);
  CHECK(a.decided.unexplained == 0);
  CHECK(a.inconsistent == 0);
  CHECK(a.worst_point <= kBounds.plane);
  CHECK(a.hits > a.rays / 50);
}

}  // namespace hiprt::checks
