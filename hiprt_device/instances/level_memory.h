#pragma once
/// What a ray in a scene of instances has to remember, in memory that its stack's Storage names.

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

/// Room for a ray. A BasicRay has initialisers, which variables in shared memory must not have.
template <class Real> struct RayStorage {
  alignas(BasicRay<Real>) std::byte bytes[sizeof(BasicRay<Real>)];
  HIPRT_HD HIPRT_INLINE BasicRay<Real>& get() { return *reinterpret_cast<BasicRay<Real>*>(bytes); }
};

/// The ray of a query, and what makes its slabs outside of each instance that it is in, for the way out. Then what is
/// on the ray's way, and three ways through instances: the ray's, the hit's, and that of the hit before.
///
/// A thread's own memory will do. In batches (trace_batch()) of rays that part ways, one level's are better in shared
/// memory, 56 bytes per thread: NVIDIA's local memory is laid out for lanes that go together (decision 0014). On AMD,
/// where accesses through this pointer find out the kind of memory at run time, nothing is measured.
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
/// One level needs no more than numbers for its ways.
template <class Real> struct PathMemory<1, Real> {
  RayStorage<Real> ray;
  SavedSlabs outside[1];
};

namespace stack_detail {

/// *pointer, by an index that NVIDIA's compiler does not know, so that what is there stays in memory. It would be kept
/// in registers, and what every test of boxes uses would be spilled.
template <class T> HIPRT_HD HIPRT_INLINE T& in_memory(T* pointer) {
  unsigned zero = 0;
#if defined(__CUDA_ARCH__)
  asm volatile("mov.u32 %0, 0;" : "=r"(zero));
#endif
  return pointer[zero];
}

}  // namespace stack_detail

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
