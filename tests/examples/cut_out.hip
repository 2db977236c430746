// A filter: triangles whose texture is transparent at the hit are not there.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct CutOut {
  const unsigned (*triangles)[3];  ///< Of geometry 0: vertices per primitive.
  const float (*uv)[2];            ///< Per vertex, in [0, 1).
  const float* alpha;              ///< size * size texels.
  unsigned size;

  HIPRT_HD hiprt::FilterResult operator()(const hiprt::Ray&, const hiprt::Hit& hit) const {
    if (hit.geometry != 0) return hiprt::FilterResult::kAccept;
    const auto [a, b, c] = triangles[hit.primitive];
    const float x = (1 - hit.u - hit.v) * uv[a][0] + hit.u * uv[b][0] + hit.v * uv[c][0];
    const float y = (1 - hit.u - hit.v) * uv[a][1] + hit.u * uv[b][1] + hit.v * uv[c][1];
    const float size_float = static_cast<float>(size);
    const unsigned texel = static_cast<unsigned>(y * size_float) * size + static_cast<unsigned>(x * size_float);
    return alpha[texel] < 0.5f ? hiprt::FilterResult::kReject : hiprt::FilterResult::kAccept;
  }
};

__global__ void trace_cut_out(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count,
                              CutOut filter) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  hiprt::PrivateStack<>::Memory memory;
  hits[i] = hiprt::ClosestHit<hiprt::Policies, CutOut>(scene, rays[i], memory, filter).next_hit();
}
