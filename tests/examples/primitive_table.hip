// Ray types: camera rays (0) meet opaque balls (custom type 0) and glass ones (1), shadow rays (1) opaque ones only.

#include <hip/hip_runtime.h>
#include "balls.h"

using BallTable = hiprt::PrimitiveTable<hiprt::PrimitiveList<Balls, Balls>, hiprt::PrimitiveList<Balls>>;
using BallRow = hiprt::TableRow<BallTable>;

__global__ void trace_types(hiprt::SceneView scene, const hiprt::Ray* rays, const unsigned* ray_types, bool* met,
                            unsigned count, Balls opaque, Balls glass) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const BallRow row{BallTable{{opaque, glass}, {opaque}}, ray_types[i]};
  hiprt::PrivateStack<>::Memory memory;
  hiprt::OneHit<hiprt::Policies, hiprt::NoFilter, BallRow> query(scene, rays[i], memory, {}, row);
  met[i] = query.next_hit().found();
}
