#include "embree_trace.h"

namespace hiprt::bench {
namespace {

RTCRay to_embree(const Ray& ray) {
  return RTCRay{ray.origin.x,
                ray.origin.y,
                ray.origin.z,
                ray.tmin,
                ray.direction.x,
                ray.direction.y,
                ray.direction.z,
                ray.time,
                ray.tmax,
                ray.mask,
                0,
                0};
}

Hit closest(RTCScene scene, const Ray& ray) {
  RTCRayHit query;
  query.ray = to_embree(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  embree::intersect1(scene, query);
  Hit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.t = query.ray.tfar;
  hit.u = query.hit.u;
  hit.v = query.hit.v;
  hit.geometry = query.hit.geomID;
  hit.primitive = query.hit.primID;
  hit.normal = {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
  return hit;
}

Hit any(RTCScene scene, const Ray& ray) {
  RTCRay query = to_embree(ray);
  embree::occluded1(scene, query);
  Hit hit;
  if (query.tfar < 0.0f) hit.t = 0.0f, hit.primitive = 0;
  return hit;
}

}  // namespace

void embree_trace(RTCScene scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) {
  if (any_hit)
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = any(scene, rays[i]);
  else
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = closest(scene, rays[i]);
}

}  // namespace hiprt::bench
