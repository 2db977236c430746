#version 460
#extension GL_EXT_ray_query : require
#extension GL_GOOGLE_include_directive : require
// One ray per invocation, in the rays' order.
#include "rays.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(push_constant) uniform Count { uint rays; } count;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count.rays) return;
  const Ray ray = load_ray(i);
  uint flags = gl_RayFlagsOpaqueEXT;
#ifdef ANY_HIT
  flags |= gl_RayFlagsTerminateOnFirstHitEXT;
#endif
  rayQueryEXT query;
  rayQueryInitializeEXT(query, scene, flags, 0xff, ray.origin, ray.tmin, ray.direction, ray.tmax);
  // Opaque triangles need no decisions.
  while (rayQueryProceedEXT(query)) {
  }
  const bool found = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
#ifdef ANY_HIT
  results.of[i] = found ? kAnyHit : kMiss;
#else
  results.of[i] = kMiss;
  if (found)
    results.of[i] = uvec4(floatBitsToUint(rayQueryGetIntersectionTEXT(query, true)),
                          rayQueryGetIntersectionInstanceIdEXT(query, true),
                          rayQueryGetIntersectionGeometryIndexEXT(query, true),
                          rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
#endif
}
