// An any-hit query that goes on, for rays that start on a primitive.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

constexpr unsigned kMostBlockers = 4;

/// rays[i] starts on the primitive of starts[i]. blockers[i]: how many others it meets, counted up to kMostBlockers;
/// ~0u: not known.
__global__ void count_blockers(hiprt::SceneView scene, const hiprt::Ray* rays, const hiprt::Hit* starts,
                               unsigned* blockers, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const hiprt::ExceptPrimitive filter{starts[i].geometry, starts[i].primitive};
  hiprt::PrivateStack<>::Memory memory;
  hiprt::AnyHit<hiprt::Policies, hiprt::ExceptPrimitive> query(scene, rays[i], memory, filter);
  unsigned met = 0;
  while (met < kMostBlockers && query.next_hit().found()) ++met;
  const bool ended = query.state() == hiprt::TraversalState::kFinished;  // There are no more.
  blockers[i] = met == kMostBlockers || ended ? met : ~0u;
}
