#include "embree_trace.h"

#include <algorithm>

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

constexpr std::size_t kEight = 8;

/// Up to eight rays. @param valid becomes Embree's mask of the rays.
void gather(std::span<const Ray> rays, RTCRayHit8& query, int (&valid)[kEight]) {
  for (std::size_t i = 0; i < kEight; ++i) {
    valid[i] = i < rays.size() ? -1 : 0;
    const RTCRay ray = to_embree(rays[i < rays.size() ? i : 0]);
    query.ray.org_x[i] = ray.org_x;
    query.ray.org_y[i] = ray.org_y;
    query.ray.org_z[i] = ray.org_z;
    query.ray.tnear[i] = ray.tnear;
    query.ray.dir_x[i] = ray.dir_x;
    query.ray.dir_y[i] = ray.dir_y;
    query.ray.dir_z[i] = ray.dir_z;
    query.ray.time[i] = ray.time;
    query.ray.tfar[i] = ray.tfar;
    query.ray.mask[i] = ray.mask;
    query.ray.id[i] = 0;
    query.ray.flags[i] = 0;
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

void scatter(const RTCRayHit8& query, bool any_hit, std::span<Hit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    Hit hit;
    if (any_hit) {
      if (query.ray.tfar[i] < 0.0f) hit.t = 0.0f, hit.primitive = 0;
    } else if (query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) {
      hit.t = query.ray.tfar[i];
      hit.u = query.hit.u[i];
      hit.v = query.hit.v[i];
      hit.geometry = query.hit.geomID[i];
      hit.primitive = query.hit.primID[i];
      hit.normal = {query.hit.Ng_x[i], query.hit.Ng_y[i], query.hit.Ng_z[i]};
    }
    hits[i] = hit;
  }
}

}  // namespace

void embree_trace_eight(RTCScene scene, bool any_hit, bool coherent, std::span<const Ray> rays, std::span<Hit> hits) {
  for (std::size_t first = 0; first < rays.size(); first += kEight) {
    const std::size_t count = std::min(kEight, rays.size() - first);
    alignas(32) RTCRayHit8 query;
    alignas(32) int valid[kEight];
    gather(rays.subspan(first, count), query, valid);
    if (any_hit)
      embree::occluded8(valid, scene, query.ray, coherent);
    else
      embree::intersect8(valid, scene, query, coherent);
    scatter(query, any_hit, hits.subspan(first, count));
  }
}

void embree_trace(RTCScene scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) {
  if (any_hit)
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = any(scene, rays[i]);
  else
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = closest(scene, rays[i]);
}

}  // namespace hiprt::bench
