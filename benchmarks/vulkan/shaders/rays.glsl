// Rays and results of all shaders. ANY_HIT: only whether there is a hit counts.

struct Ray {
  vec3 origin;
  float tmin;
  vec3 direction;
  float tmax;
};

// hiprt::Ray: origin, tmin, direction, tmax, mask, time.
layout(std430, set = 0, binding = 1) readonly buffer Rays { vec2 words[]; } rays;
// Result (tracer.cpp): the bits of t, instance, geometry, primitive.
layout(std430, set = 0, binding = 2) writeonly buffer Results { uvec4 of[]; } results;

const uint kNone = 0xffffffffu;

Ray load_ray(uint i) {
  const vec2 a = rays.words[5 * i], b = rays.words[5 * i + 1];
  const vec2 c = rays.words[5 * i + 2], d = rays.words[5 * i + 3];
  return Ray(vec3(a, b.x), b.y, vec3(c, d.x), d.y);
}

const uvec4 kMiss = uvec4(0x7f800000u, kNone, kNone, kNone);
const uvec4 kAnyHit = uvec4(0u, 0u, 0u, 0u);
