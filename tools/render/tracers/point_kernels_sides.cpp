/// On which sides of closed surfaces points are. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/tracers/point_policies.h>

#include <hiprt_device/query/winding_number.h>

#define HIPRT_FIND_SIDES HIPRT_JOIN(find_sides_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

struct FindAll {
  const SideJob& job;

  template <class P> bool operator()() const {
    typename P::Stack::Memory memory;
    for (std::size_t i = 0; i < job.count; ++i) {
      const Side side = is_inside<P>(*job.scene, job.queries[i], memory);
      if (side == Side::kUnknown) return false;
      job.inside[i] = side == Side::kInside ? 1 : 0;
    }
    return true;
  }
};

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

bool HIPRT_FIND_SIDES(const SideJob& job);

bool HIPRT_FIND_SIDES(const SideJob& job) {
  if (job.winding == nullptr) return with_point_policies(*job.scene, FindAll{job});
  for (std::size_t i = 0; i < job.count; ++i)
    job.inside[i] = is_inside(*job.winding, Vec3D(job.queries[i].point)) == Side::kInside ? 1 : 0;
  return true;
}

}  // namespace hiprt::tools
