#pragma once
/// Small vectors. Only this file and vec_functions.h include GLM; the rest uses hiprt::Vec3. Programs that
/// need glm::dot(), glm::cross() and others in device code include vec_functions.h.

#include <hiprt_device/math/scalar.h>

#if !HIPRT_RUN_TIME_COMPILER
#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device begin
#endif
#include <glm/vec3.hpp>
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device end
#endif
#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic pop
#endif
#endif

namespace hiprt {

#if HIPRT_RUN_TIME_COMPILER
/// A vector with the layout and operators of GLM's. GLM needs the standard library, which run-time compilers do not
/// have.
template <class Real> struct BasicVec3 {
  Real x, y, z;

  BasicVec3() = default;
  HIPRT_HD constexpr explicit BasicVec3(Real a) : x(a), y(a), z(a) {}
  HIPRT_HD constexpr BasicVec3(Real a, Real b, Real c) : x(a), y(b), z(c) {}
  template <class Other>
  HIPRT_HD constexpr explicit BasicVec3(const BasicVec3<Other>& a)
      : x(static_cast<Real>(a.x)), y(static_cast<Real>(a.y)), z(static_cast<Real>(a.z)) {}

  HIPRT_HD constexpr Real& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  HIPRT_HD constexpr const Real& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  HIPRT_HD friend constexpr BasicVec3 operator-(const BasicVec3& a) { return {-a.x, -a.y, -a.z}; }
  HIPRT_HD friend constexpr BasicVec3 operator+(const BasicVec3& a, const BasicVec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  HIPRT_HD friend constexpr BasicVec3 operator-(const BasicVec3& a, const BasicVec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  HIPRT_HD friend constexpr BasicVec3 operator*(const BasicVec3& a, const BasicVec3& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
  }
  HIPRT_HD friend constexpr BasicVec3 operator*(const BasicVec3& a, Real b) { return {a.x * b, a.y * b, a.z * b}; }
  HIPRT_HD friend constexpr BasicVec3 operator*(Real a, const BasicVec3& b) { return b * a; }
  HIPRT_HD friend constexpr BasicVec3 operator/(const BasicVec3& a, Real b) { return {a.x / b, a.y / b, a.z / b}; }
  HIPRT_HD friend constexpr bool operator==(const BasicVec3& a, const BasicVec3& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
};
#else
/// Three numbers x, y, z; also v[0] to v[2]. An index that varies at run time moves the vector to memory on a GPU.
template <class Real> using BasicVec3 = glm::vec<3, Real>;
#endif
using Vec3 = BasicVec3<float>;
using Vec3D = BasicVec3<double>;

inline namespace HIPRT_ISA_NAMESPACE {

/// Each component correctly rounded, whatever a compiler's flags.
template <class Real> HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> divided(const BasicVec3<Real>& a, Real b) {
  return {divided(a.x, b), divided(a.y, b), divided(a.z, b)};
}

/// The largest magnitude of the components.
template <class Real> HIPRT_HD HIPRT_FORCE_INLINE Real max_component(const BasicVec3<Real>& a) {
  return max_of(max_of(absolute(a.x), absolute(a.y)), absolute(a.z));
}

}  // namespace HIPRT_ISA_NAMESPACE

}  // namespace hiprt
