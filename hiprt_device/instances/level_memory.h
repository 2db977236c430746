#pragma once
/// The memory of a ray for the instances that it is in. The stack's Storage points to it.

#include <hiprt_device/format/instance.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// An object that a ray is in, and the ray as the object sees it.
template <class Real> struct EnteredObject {
  const ObjectRecord* object;
  Real origin[3], direction[3];
};

/// Uninitialised storage of a ray. A BasicRay has initialisers, which variables in shared memory must not have.
template <class Real> struct RayStorage {
  alignas(BasicRay<Real>) std::byte bytes[sizeof(BasicRay<Real>)];
  HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real>& get() { return *reinterpret_cast<BasicRay<Real>*>(bytes); }
};

/// The memory of a ray in a scene of instances.
///
/// It has the ray of the query, the slabs outside each instance that the ray is in, the entered objects, and three
/// paths of instances. The paths are those of the ray, of the hit, and of the hit before.
///
/// It may be in the thread's own memory. In batches (trace_batch()) of divergent rays, the memory of one level is
/// better in shared memory (56 bytes per thread). NVIDIA's local memory is laid out for coherent lanes
/// (docs/decisions/0014-instances.md). AMD GPUs find out the kind of memory at each access through this pointer;
/// nothing was measured there.
///
///     __shared__ hiprt::PathMemory<1> path_memory[kBlock];
///     Tracer::Stack::Storage storage(hiprt::PrivateStack<>::Storage(memory), path_memory[threadIdx.x]);
///
/// @tparam Real of the rays.
template <unsigned kLevels, class Real = float> struct PathMemory {
  RayStorage<Real> ray;
  SavedSlabs outside[kLevels];
  EnteredObject<Real> entered[kLevels];
  std::uint32_t instance[3 * kLevels];
};
/// With one level a path is one number, which the traversal has in registers.
template <class Real> struct PathMemory<1, Real> {
  RayStorage<Real> ray;
  SavedSlabs outside[1];
};

namespace stack_detail {

/// *pointer, through an index that NVIDIA's compiler does not know. So the data stays in memory. Otherwise the
/// compiler would keep it in registers and spill what every box test uses.
template <class T> HIPRT_HD HIPRT_FORCE_INLINE T& in_memory(T* pointer) {
  unsigned zero = 0;
#if defined(__CUDA_ARCH__)
  asm volatile("mov.u32 %0, 0;" : "=r"(zero));
#endif
  return pointer[zero];
}

}  // namespace stack_detail

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
