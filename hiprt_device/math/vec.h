#pragma once
/// Small vectors. The only file that includes GLM; the rest of the library writes hiprt::Vec3.

#include <hiprt_device/math/arithmetic.h>

#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device begin
#endif
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device end
#endif
#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic pop
#endif

namespace hiprt {

/// Three numbers x, y, z; also v[0] to v[2], which on a GPU moves to memory what it indexes at run time.
template <class Real> using BasicVec3 = glm::vec<3, Real>;
using Vec3 = BasicVec3<float>;
using Vec3D = BasicVec3<double>;

inline namespace HIPRT_ISA_NAMESPACE {

/// Each component correctly rounded, whatever a compiler's flags.
template <class Real> HIPRT_HD HIPRT_INLINE BasicVec3<Real> divided(const BasicVec3<Real>& a, Real b) {
  return {divided(a.x, b), divided(a.y, b), divided(a.z, b)};
}

}  // namespace HIPRT_ISA_NAMESPACE

}  // namespace hiprt
