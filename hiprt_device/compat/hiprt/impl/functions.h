#pragma once
/// The program's intersect and filter functions as a set of custom primitives and a filter. Internal.

#include <hiprt/impl/surface.h>
#include <hiprt_device/primitives/primitive_table.h>

/// Calls the intersect function of a geometry type and a ray type: the program defines it, or a generator does.
HIPRT_DEVICE bool intersectFunc(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                                const hiprtRay& ray, void* payload, hiprtHit& hit);
/// Calls the filter function of both types. true: the hit does not count.
HIPRT_DEVICE bool filterFunc(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                             const hiprtRay& ray, void* payload, const hiprtHit& hit);

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

// A GPU compiler's host pass compiles traversals, and the functions above are not there for it.
#define HIPRT_COMPAT_HAS_FUNCTIONS (HIPRT_DEVICE_CODE || !HIPRT_GPU_COMPILER)

/// What the functions get besides the ray and the hit.
struct Functions {
  hiprtFuncTable table = nullptr;  ///< Filters are not called without one.
  void* payload = nullptr;
  std::uint32_t ray_type = 0;
  float min_t = 0.0f;  ///< Of the program's ray.

  /// @param type geomType + 1 as the geometry has it; 0: none.
  HIPRT_HD HIPRT_FORCE_INLINE bool intersects([[maybe_unused]] unsigned type, [[maybe_unused]] const hiprtRay& ray,
                                              [[maybe_unused]] hiprtHit& hit) const {
#if HIPRT_COMPAT_HAS_FUNCTIONS
    return intersectFunc(type - 1u, ray_type, header(), ray, payload, hit);
#else
    return false;
#endif
  }
  HIPRT_HD HIPRT_FORCE_INLINE bool accepts(unsigned type, [[maybe_unused]] const hiprtRay& ray,
                                           [[maybe_unused]] const hiprtHit& hit) const {
    if (type == 0 || table == nullptr) return true;
#if HIPRT_COMPAT_HAS_FUNCTIONS
    return !filterFunc(type - 1u, ray_type, header(), ray, payload, hit);
#else
    return true;
#endif
  }
  HIPRT_HD HIPRT_FORCE_INLINE hiprtFuncTableHeader header() const {
    return table == nullptr ? hiprtFuncTableHeader{0u, 1u, nullptr} : *static_cast<const hiprtFuncTableHeader*>(table);
  }
  /// The ray that the functions get.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtRay ray_of(const Ray& in_object, float limit) const {
    hiprtRay ray;
    ray.origin = to_float3(in_object.origin);
    ray.minT = min_t;
    ray.direction = to_float3(in_object.direction);
    ray.maxT = limit;
    return ray;
  }
};
#undef HIPRT_COMPAT_HAS_FUNCTIONS

/// All custom primitives: hits count as the intersect function reports them.
struct FunctionPrimitives {
  static constexpr unsigned kCount = 1;
  static constexpr bool kAnyT = true;
  Functions functions;
  float least_t = 0.0f;  ///< Triangles count from here on. Boxes count from 0 on.

  template <class Id, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(unsigned type, const Ray& ray, float, float limit, const Id& id,
                                             Report&& report) const {
    hiprtHit hit = no_hit();
    if constexpr (requires { id.path(); }) set_instances(hit, id.path());
    hit.primID = id.primitive;
    const hiprtRay seen = functions.ray_of(ray, limit);
    if (!functions.intersects(type, seen, hit) || !functions.accepts(type, seen, hit)) return true;
    return report(CustomHit{hit.t, hit.uv.x, hit.uv.y, to_vec3(hit.normal), std::bit_cast<float>(hit.primID)});
  }
  /// The functions have been asked already.
  template <class HitType> HIPRT_HD HIPRT_FORCE_INLINE FilterResult filter(unsigned, const Ray&, const HitType&) const {
    return FilterResult::kAccept;
  }
};

/// The filter function for triangles.
/// @tparam Layout of the scene.
template <class Layout> struct FunctionFilter {
  Functions functions;

  template <class HitType, class Questions>
  HIPRT_HD HIPRT_FORCE_INLINE FilterResult operator()(const Ray&, const HitType& candidate,
                                                      const Questions& questions) const {
    if (functions.table == nullptr) return FilterResult::kAccept;
    const unsigned type = questions.type();
    if (type == 0) return FilterResult::kAccept;
    const Ray ray = questions.object_ray();
    hiprtHit hit = no_hit();
    set_instances(hit, questions.path());
    hit.primID = candidate.primitive;
    hit.uv = hiprtFloat2{candidate.u, candidate.v};
    hit.normal = to_float3(triangle_normal<Layout>(questions.leaf(), questions.leaf_triangle()));
    hit.t = candidate.t;
    return functions.accepts(type, functions.ray_of(ray, ray.tmax), hit) ? FilterResult::kAccept
                                                                         : FilterResult::kReject;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
