#pragma once
/// Arithmetic of vectors under HIPRT's names: operators, and functions in namespace hiprt.
///
/// All functions are templates. So a non-template function for the same type, of the compiler or the program, is
/// preferred.

#include <hiprt/hiprt_vec.h>
#include <hiprt/impl/vector_traits.h>

namespace hiprt {

/// The operators of vectors, component by component. HIP's vectors have their own.
namespace vector_operators {

#define HIPRT_COMPAT_VECTOR_OPERATOR(op)                                                \
  template <typename V, typename = compat_detail::IfVector<V>>                          \
  HIPRT_HOST_DEVICE inline V operator op(const V& a, const V& b) {                      \
    using T = compat_detail::ComponentOf<V>;                                            \
    return compat_detail::zip(a, b, [](T x, T y) -> T { return x op y; });              \
  }                                                                                     \
  template <typename V, typename = compat_detail::IfVector<V>>                          \
  HIPRT_HOST_DEVICE inline V operator op(const V& a, compat_detail::ComponentOf<V> b) { \
    return a op compat_detail::filled<V>(b);                                            \
  }                                                                                     \
  template <typename V, typename = compat_detail::IfVector<V>>                          \
  HIPRT_HOST_DEVICE inline V operator op(compat_detail::ComponentOf<V> a, const V& b) { \
    return compat_detail::filled<V>(a) op b;                                            \
  }                                                                                     \
  template <typename V, typename = compat_detail::IfVector<V>>                          \
  HIPRT_HOST_DEVICE inline V& operator op##=(V& a, const V& b) {                        \
    return a = a op b;                                                                  \
  }                                                                                     \
  template <typename V, typename = compat_detail::IfVector<V>>                          \
  HIPRT_HOST_DEVICE inline V& operator op##=(V& a, compat_detail::ComponentOf<V> b) {   \
    return a = a op b;                                                                  \
  }
HIPRT_COMPAT_VECTOR_OPERATOR(+)
HIPRT_COMPAT_VECTOR_OPERATOR(-)
HIPRT_COMPAT_VECTOR_OPERATOR(*)
HIPRT_COMPAT_VECTOR_OPERATOR(/)
#undef HIPRT_COMPAT_VECTOR_OPERATOR

template <typename V, typename = compat_detail::IfVector<V>> HIPRT_HOST_DEVICE inline V operator-(const V& a) {
  using T = compat_detail::ComponentOf<V>;
  return compat_detail::zip(a, a, [](T x, T) -> T { return -x; });
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline bool operator==(const V& a, const V& b) {
  using T = compat_detail::ComponentOf<V>;
  return compat_detail::holds_for_all(a, b, [](T x, T y) -> bool { return x == y; });
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline bool operator!=(const V& a, const V& b) {
  return !(a == b);
}

}  // namespace vector_operators

#if !defined(__HIPCC__)
#define HIPRT_COMPAT_USE_OPERATORS    \
  using vector_operators::operator+;  \
  using vector_operators::operator-;  \
  using vector_operators::operator*;  \
  using vector_operators::operator/;  \
  using vector_operators::operator+=; \
  using vector_operators::operator-=; \
  using vector_operators::operator*=; \
  using vector_operators::operator/=; \
  using vector_operators::operator==; \
  using vector_operators::operator!=;
// Argument-dependent lookup finds them here for hiprt::Vector.
HIPRT_COMPAT_USE_OPERATORS
#endif

/// The smaller and the larger of two, component by component.
template <typename V, typename = compat_detail::IfVector<V>> HIPRT_HOST_DEVICE inline V min(const V& a, const V& b) {
  using T = compat_detail::ComponentOf<V>;
  return compat_detail::zip(a, b, [](T x, T y) -> T { return y < x ? y : x; });
}
template <typename V, typename = compat_detail::IfVector<V>> HIPRT_HOST_DEVICE inline V max(const V& a, const V& b) {
  using T = compat_detail::ComponentOf<V>;
  return compat_detail::zip(a, b, [](T x, T y) -> T { return x < y ? y : x; });
}
template <typename T, compat_detail::IfNumber<T> = 0> HIPRT_HOST_DEVICE constexpr T min(T a, T b) {
  return b < a ? b : a;
}
template <typename T, compat_detail::IfNumber<T> = 0> HIPRT_HOST_DEVICE constexpr T max(T a, T b) {
  return a < b ? b : a;
}

/// x between low and high.
template <typename T, compat_detail::IfNumber<T> = 0> HIPRT_HOST_DEVICE constexpr T clamp(T x, T low, T high) {
  return x < low ? low : high < x ? high : x;
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline V clamp(const V& x, const V& low, const V& high) {
  return hiprt::max(low, hiprt::min(x, high));
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline V clamp(const V& x, compat_detail::ComponentOf<V> low, compat_detail::ComponentOf<V> high) {
  return hiprt::clamp(x, compat_detail::filled<V>(low), compat_detail::filled<V>(high));
}

/// a * b + c with one rounding.
template <typename T, compat_detail::IfFloat<T> = 0> HIPRT_HOST_DEVICE inline T fma(T a, T b, T c) {
  return ::fmaf(a, b, c);
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline V fma(const V& a, const V& b, const V& c) {
  V result = a;
  result.x = ::fmaf(a.x, b.x, c.x);
  result.y = ::fmaf(a.y, b.y, c.y);
  if constexpr (compat_detail::kSizeOf < V >> 2) result.z = ::fmaf(a.z, b.z, c.z);
  if constexpr (compat_detail::kSizeOf < V >> 3) result.w = ::fmaf(a.w, b.w, c.w);
  return result;
}

/// a * b + c * d, and a * b - c * d. Both round well where the terms nearly cancel (Kahan).
template <typename T, compat_detail::IfFloat<T> = 0> HIPRT_HOST_DEVICE inline T sumOfProducts(T a, T b, T c, T d) {
  const T cd = c * d;
  return ::fmaf(a, b, cd) + ::fmaf(c, d, -cd);
}
template <typename T, compat_detail::IfFloat<T> = 0>
HIPRT_HOST_DEVICE inline T differenceOfProducts(T a, T b, T c, T d) {
  return hiprt::sumOfProducts(a, b, -c, d);
}

/// The sum of a's components times b's.
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline compat_detail::ComponentOf<V> dot(const V& a, const V& b) {
  compat_detail::ComponentOf<V> sum = a.x * b.x + a.y * b.y;
  if constexpr (compat_detail::kSizeOf < V >> 2) sum += a.z * b.z;
  if constexpr (compat_detail::kSizeOf < V >> 3) sum += a.w * b.w;
  return sum;
}
/// The vector at right angles to both.
template <typename V, compat_detail::IfThreeFloats<V> = 0> HIPRT_HOST_DEVICE inline V cross(const V& a, const V& b) {
  V result = a;
  result.x = a.y * b.z - a.z * b.y;
  result.y = a.z * b.x - a.x * b.z;
  result.z = a.x * b.y - a.y * b.x;
  return result;
}
/// The vector of length 1 in the same direction; not a number for a vector of length 0.
template <typename V, compat_detail::IfFloats<V> = 0> HIPRT_HOST_DEVICE inline V normalize(const V& a) {
  return compat_detail::times(a, 1.0f / ::sqrtf(hiprt::dot(a, a)));
}
/// sqrt(a^2 + b^2), and the length of a vector.
template <typename T, compat_detail::IfFloat<T> = 0> HIPRT_HOST_DEVICE inline T hypot(T a, T b) {
  return ::hypotf(a, b);
}
template <typename V, compat_detail::IfFloats<V> = 0> HIPRT_HOST_DEVICE inline float hypot(const V& a) {
  return ::sqrtf(hiprt::dot(a, a));
}

/// a at t = 0 and b at t = 1.
template <typename T, compat_detail::IfFloat<T> = 0> HIPRT_HOST_DEVICE constexpr T mix(T a, T b, T t) {
  return a + (b - a) * t;
}
template <typename V, compat_detail::IfFloats<V> = 0> HIPRT_HOST_DEVICE inline V mix(const V& a, const V& b, float t) {
  return compat_detail::zip(compat_detail::times(a, 1.0f - t), compat_detail::times(b, t),
                            [](float x, float y) -> float { return x + y; });
}
/// -1, 0 or 1.
template <typename T, compat_detail::IfNumber<T> = 0> HIPRT_HOST_DEVICE constexpr T sign(T a) {
  return a > T(0) ? T(1) : a < T(0) ? T(-1) : T(0);
}

/// The address of the first component.
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline compat_detail::ComponentOf<V>* ptr(V& a) {
  return &a.x;
}
template <typename V, typename = compat_detail::IfVector<V>>
HIPRT_HOST_DEVICE inline const compat_detail::ComponentOf<V>* ptr(const V& a) {
  return &a.x;
}

#define HIPRT_COMPAT_MAKE(T, Name, Of2, Of3, Of4)                                                               \
  template <typename A, typename B, compat_detail::IfNumber<A> = 0, compat_detail::IfNumber<B> = 0>             \
  HIPRT_HOST_DEVICE inline Of2 make_##Name##2(A x, B y) {                                                       \
    return Of2{T(x), T(y)};                                                                                     \
  }                                                                                                             \
  template <typename A, compat_detail::IfNumber<A> = 0> HIPRT_HOST_DEVICE inline Of2 make_##Name##2(A all) {    \
    return Of2{T(all), T(all)};                                                                                 \
  }                                                                                                             \
  template <typename V, typename = compat_detail::IfVector<V>>                                                  \
  HIPRT_HOST_DEVICE inline Of2 make_##Name##2(const V& a) {                                                     \
    return Of2{T(a.x), T(a.y)};                                                                                 \
  }                                                                                                             \
  template <typename A, typename B, typename C, compat_detail::IfNumber<A> = 0, compat_detail::IfNumber<B> = 0, \
            compat_detail::IfNumber<C> = 0>                                                                     \
  HIPRT_HOST_DEVICE inline Of3 make_##Name##3(A x, B y, C z) {                                                  \
    return Of3{T(x), T(y), T(z)};                                                                               \
  }                                                                                                             \
  template <typename A, compat_detail::IfNumber<A> = 0> HIPRT_HOST_DEVICE inline Of3 make_##Name##3(A all) {    \
    return Of3{T(all), T(all), T(all)};                                                                         \
  }                                                                                                             \
  template <typename V, compat_detail::IfAtLeastThree<V> = 0>                                                   \
  HIPRT_HOST_DEVICE inline Of3 make_##Name##3(const V& a) {                                                     \
    return Of3{T(a.x), T(a.y), T(a.z)};                                                                         \
  }                                                                                                             \
  template <typename A, compat_detail::IfNumber<A> = 0>                                                         \
  HIPRT_HOST_DEVICE inline Of3 make_##Name##3(const Of2& a, A z) {                                              \
    return Of3{a.x, a.y, T(z)};                                                                                 \
  }                                                                                                             \
  template <typename A, typename B, typename C, typename D, compat_detail::IfNumber<A> = 0,                     \
            compat_detail::IfNumber<B> = 0, compat_detail::IfNumber<C> = 0, compat_detail::IfNumber<D> = 0>     \
  HIPRT_HOST_DEVICE inline Of4 make_##Name##4(A x, B y, C z, D w) {                                             \
    return Of4{T(x), T(y), T(z), T(w)};                                                                         \
  }                                                                                                             \
  template <typename A, compat_detail::IfNumber<A> = 0> HIPRT_HOST_DEVICE inline Of4 make_##Name##4(A all) {    \
    return Of4{T(all), T(all), T(all), T(all)};                                                                 \
  }                                                                                                             \
  template <typename A, compat_detail::IfNumber<A> = 0>                                                         \
  HIPRT_HOST_DEVICE inline Of4 make_##Name##4(const Of3& a, A w) {                                              \
    return Of4{a.x, a.y, a.z, T(w)};                                                                            \
  }                                                                                                             \
  HIPRT_HOST_DEVICE inline Of4 make_##Name##4(const Of2& a, const Of2& b) { return Of4{a.x, a.y, b.x, b.y}; }
// Vectors from numbers of any type, from one number for all components, and from shorter or longer vectors.
HIPRT_COMPAT_MAKE(float, float, hiprtFloat2, hiprtFloat3, hiprtFloat4)
HIPRT_COMPAT_MAKE(int, int, hiprtInt2, hiprtInt3, hiprtInt4)
HIPRT_COMPAT_MAKE(uint32_t, uint, hiprtUint2, hiprtUint3, hiprtUint4)
#undef HIPRT_COMPAT_MAKE

#if defined(__KERNELCC__)
/// The smaller or larger of the number there and another; neither is NaN.
/// @return the number before.
HIPRT_DEVICE inline float atomicMinFloat(float* address, float value) {
  // Negative floats as unsigned integers are in reverse order, and above all others.
  if (as_int(value) >= 0) return as_float(::atomicMin(reinterpret_cast<int*>(address), as_int(value)));
  return as_float(::atomicMax(reinterpret_cast<unsigned int*>(address), as_uint(value)));
}
HIPRT_DEVICE inline float atomicMaxFloat(float* address, float value) {
  if (as_int(value) >= 0) return as_float(::atomicMax(reinterpret_cast<int*>(address), as_int(value)));
  return as_float(::atomicMin(reinterpret_cast<unsigned int*>(address), as_uint(value)));
}
#endif

}  // namespace hiprt

#if !defined(__HIPCC__)
#if defined(__KERNELCC__)
// CUDA's vectors are global: argument-dependent lookup finds their operators here.
namespace vector_operators = hiprt::vector_operators;
HIPRT_COMPAT_USE_OPERATORS
#endif
#undef HIPRT_COMPAT_USE_OPERATORS
#endif
