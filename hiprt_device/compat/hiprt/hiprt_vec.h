#pragma once
/// HIPRT's names of vectors: aliases of a kernel compiler's float2, ..., else structs with the same layout.

#include <hiprt/hiprt_common.h>

#if defined(__KERNELCC__)
using hiprtFloat2 = float2;
using hiprtFloat3 = float3;
using hiprtFloat4 = float4;
using hiprtInt2 = int2;
using hiprtInt3 = int3;
using hiprtInt4 = int4;
using hiprtUint2 = uint2;
using hiprtUint3 = uint3;
using hiprtUint4 = uint4;
#else
namespace hiprt {

/// N numbers x, y, z, w.
template <typename T, int N> struct Vector;
template <typename T> struct alignas(8) Vector<T, 2> {
  T x, y;
  Vector() = default;
  constexpr Vector(T x_, T y_) : x(x_), y(y_) {}
  constexpr explicit Vector(T all) : x(all), y(all) {}
};
template <typename T> struct alignas(4) Vector<T, 3> {
  T x, y, z;
  Vector() = default;
  constexpr Vector(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
  constexpr explicit Vector(T all) : x(all), y(all), z(all) {}
};
template <typename T> struct alignas(16) Vector<T, 4> {
  T x, y, z, w;
  Vector() = default;
  constexpr Vector(T x_, T y_, T z_, T w_) : x(x_), y(y_), z(z_), w(w_) {}
  constexpr explicit Vector(T all) : x(all), y(all), z(all), w(all) {}
};

}  // namespace hiprt
using hiprtFloat2 = hiprt::Vector<float, 2>;
using hiprtFloat3 = hiprt::Vector<float, 3>;
using hiprtFloat4 = hiprt::Vector<float, 4>;
using hiprtInt2 = hiprt::Vector<int, 2>;
using hiprtInt3 = hiprt::Vector<int, 3>;
using hiprtInt4 = hiprt::Vector<int, 4>;
using hiprtUint2 = hiprt::Vector<uint32_t, 2>;
using hiprtUint3 = hiprt::Vector<uint32_t, 3>;
using hiprtUint4 = hiprt::Vector<uint32_t, 4>;
#endif

static_assert(sizeof(hiprtFloat2) == 8 && sizeof(hiprtFloat3) == 12 && sizeof(hiprtFloat4) == 16, "layout of HIPRT");
static_assert(alignof(hiprtFloat2) == 8 && alignof(hiprtFloat3) == 4 && alignof(hiprtFloat4) == 16, "layout of HIPRT");
