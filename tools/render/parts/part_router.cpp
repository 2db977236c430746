#include <tools/render/parts/part_router.h>

#include <hiprt_device/hiprt_device.h>

#include <algorithm>
#include <limits>

namespace hiprt::tools {
namespace {

/// Where a ray enters a box, no later than the traversal of the part says; infinity: it does not meet the box.
float entry_of(const Box& box, const RaySlabs<ArrayLanes>& ray, float tmin, float tmax) {
  if (!meets_box<ArrayLanes>(box, ray, tmin, tmax)) return std::numeric_limits<float>::infinity();
  float enter = tmin;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const float plane = ray.is_down(axis) ? box.max[axis] : box.min[axis];
    enter = std::max(enter,
                     multiply_add(plane, ArrayLanes::value(ray.rcp[axis]), ArrayLanes::value(ray.near_offset[axis])));
  }
  return enter;
}

}  // namespace

void PartRouter::route(const Ray& ray, std::vector<PartVisit>& visits) const {
  if (!is_traceable(ray)) return;
  const std::size_t first = visits.size();
  const float tmin = std::max(ray.tmin, 0.0f), tmax = std::min(ray.tmax, std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const ScenePart& part = parts_[i];
    if (part.boxes.empty()) continue;
    const RaySlabs<ArrayLanes> slabs(ray, Conservative::margin(ray.origin, part.bounds, part.condition, part.reach));
    if (!meets_box<ArrayLanes>(part.bounds, slabs, tmin, tmax)) continue;
    float enter = std::numeric_limits<float>::infinity();
    for (const Box& box : part.boxes) enter = std::min(enter, entry_of(box, slabs, tmin, tmax));
    if (enter <= tmax) visits.push_back({static_cast<std::uint32_t>(i), enter});
  }
  std::sort(
      visits.begin() + static_cast<std::ptrdiff_t>(first), visits.end(),
      [](const PartVisit& a, const PartVisit& b) { return a.enter != b.enter ? a.enter < b.enter : a.part < b.part; });
}

}  // namespace hiprt::tools
