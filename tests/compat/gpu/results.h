#pragma once
/// What the test on GPUs compares: numbers of hits, in types that all compilers have.

#include <hiprt_build/buffer.h>

#include <cstdint>
#include <vector>

namespace hiprt::test {

/// Numbers of a hit, or of all hits.
struct TraceResult {
  float t = 0, u = 0, v = 0, normal[3] = {};
  std::uint32_t primitive = 0, instance[4] = {}, state = 0, hits = 0;
};
/// The results of one ray: geometries of triangles and of squares, a scene, each with the closest hit and all hits.
inline constexpr unsigned kResultsPerRay = 6;
/// Of the squares, and the limit of the filter function.
inline constexpr float kSize = 0.125f, kFilterLimit = 0.75f;

struct TraceRay {
  float origin[3], direction[3], min_t, max_t, time;
};

/// BVH files of the three, and rays.
struct TraceInput {
  build::Buffer mesh, squares, scene;
  std::vector<TraceRay> rays;
  std::vector<float> centers;  ///< Of the squares, three numbers each.
};
TraceInput make_input();

/// The results on the host.
std::vector<TraceResult> trace_on_host(const TraceInput& input);

}  // namespace hiprt::test
