#pragma once
/// What hiprt_math.h knows of vectors. Internal.

#include <hiprt/hiprt_vec.h>

namespace hiprt::compat_detail {

/// A type that is no vector has no Component.
template <typename V> struct VectorTraits { static constexpr int kSize = 0; };
template <typename T, int N> struct Components {
  using Component = T;
  static constexpr int kSize = N;
};
template <> struct VectorTraits<hiprtFloat2> : Components<float, 2> {};
template <> struct VectorTraits<hiprtFloat3> : Components<float, 3> {};
template <> struct VectorTraits<hiprtFloat4> : Components<float, 4> {};
template <> struct VectorTraits<hiprtInt2> : Components<int, 2> {};
template <> struct VectorTraits<hiprtInt3> : Components<int, 3> {};
template <> struct VectorTraits<hiprtInt4> : Components<int, 4> {};
template <> struct VectorTraits<hiprtUint2> : Components<uint32_t, 2> {};
template <> struct VectorTraits<hiprtUint3> : Components<uint32_t, 3> {};
template <> struct VectorTraits<hiprtUint4> : Components<uint32_t, 4> {};

template <typename V> using ComponentOf = typename VectorTraits<V>::Component;
template <typename V> inline constexpr int kSizeOf = VectorTraits<V>::kSize;

template <bool kHolds, typename T> struct EnableIf { using Type = T; };
template <typename T> struct EnableIf<false, T> {};

/// The following exist for some types only, so that a template is for these types.
template <typename V> using IfVector = ComponentOf<V>;
template <typename V> using IfFloats = typename EnableIf<is_same<ComponentOf<V>, float>::value, int>::Type;
template <typename V>
using IfThreeFloats = typename EnableIf<is_same<ComponentOf<V>, float>::value && kSizeOf<V> == 3, int>::Type;
template <typename V> using IfAtLeastThree = typename EnableIf<(kSizeOf<V> >= 3), int>::Type;
template <typename T> using IfFloat = typename EnableIf<is_same<T, float>::value, int>::Type;

template <typename T> struct IsNumber { static constexpr bool value = false; };
template <> struct IsNumber<float> { static constexpr bool value = true; };
template <> struct IsNumber<double> { static constexpr bool value = true; };
template <> struct IsNumber<signed char> { static constexpr bool value = true; };
template <> struct IsNumber<unsigned char> { static constexpr bool value = true; };
template <> struct IsNumber<short> { static constexpr bool value = true; };
template <> struct IsNumber<unsigned short> { static constexpr bool value = true; };
template <> struct IsNumber<int> { static constexpr bool value = true; };
template <> struct IsNumber<unsigned int> { static constexpr bool value = true; };
template <> struct IsNumber<long> { static constexpr bool value = true; };
template <> struct IsNumber<unsigned long> { static constexpr bool value = true; };
template <> struct IsNumber<long long> { static constexpr bool value = true; };
template <> struct IsNumber<unsigned long long> { static constexpr bool value = true; };
template <typename T> using IfNumber = typename EnableIf<IsNumber<T>::value, int>::Type;

/// The vector of function(component of a, component of b).
template <typename V, typename Function> HIPRT_HOST_DEVICE inline V zip(const V& a, const V& b, Function function) {
  V result = a;
  result.x = function(a.x, b.x);
  result.y = function(a.y, b.y);
  if constexpr (kSizeOf < V >> 2) result.z = function(a.z, b.z);
  if constexpr (kSizeOf < V >> 3) result.w = function(a.w, b.w);
  return result;
}
template <typename V, typename Function>
HIPRT_HOST_DEVICE inline bool holds_for_all(const V& a, const V& b, Function function) {
  bool all = function(a.x, b.x) && function(a.y, b.y);
  if constexpr (kSizeOf < V >> 2) all = all && function(a.z, b.z);
  if constexpr (kSizeOf < V >> 3) all = all && function(a.w, b.w);
  return all;
}
/// The vector whose components all are a number.
template <typename V> HIPRT_HOST_DEVICE inline V filled(ComponentOf<V> number) {
  V result;
  result.x = result.y = number;
  if constexpr (kSizeOf < V >> 2) result.z = number;
  if constexpr (kSizeOf < V >> 3) result.w = number;
  return result;
}
template <typename V> HIPRT_HOST_DEVICE inline V times(const V& a, ComponentOf<V> factor) {
  using T = ComponentOf<V>;
  return zip(a, filled<V>(factor), [](T x, T y) -> T { return x * y; });
}

}  // namespace hiprt::compat_detail
