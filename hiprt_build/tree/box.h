#pragma once
/// Axis-aligned boxes of the builders: Box, the record in memory and in files, and SimdBox, the same box in vector
/// registers for inner loops. Internal.

#include <hiprt_build/format/box.h>

#include <limits>

namespace hiprt::build {

using format_detail::empty_box;
using format_detail::grow;
using format_detail::half_area;
using format_detail::unite;

HIPRT_HD constexpr bool is_empty(const Box& box) { return !(box.min[0] <= box.max[0]); }

/// Half the centre: halved again so that sums and extents stay finite for every finite box.
HIPRT_HD constexpr float split_position(const Box& box, unsigned axis) {
  return 0.25f * box.min[axis] + 0.25f * box.max[axis];
}

#if defined(__CUDACC__)
/// nvcc has no vector type: its translation units use an array instead, under another mangled name.
inline namespace cuda_vectors {

struct alignas(16) Float4 {
  float v[4];

  HIPRT_HD HIPRT_FORCE_INLINE float& operator[](int i) { return v[i]; }
  HIPRT_HD HIPRT_FORCE_INLINE float operator[](int i) const { return v[i]; }
};
HIPRT_HD HIPRT_FORCE_INLINE Float4 operator+(Float4 a, Float4 b) {
  return Float4{{a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]}};
}
HIPRT_HD HIPRT_FORCE_INLINE Float4 operator-(Float4 a, Float4 b) {
  return Float4{{a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]}};
}
HIPRT_HD HIPRT_FORCE_INLINE Float4 operator*(Float4 a, Float4 b) {
  return Float4{{a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]}};
}
HIPRT_HD HIPRT_FORCE_INLINE Float4 operator*(float a, Float4 b) { return Float4{{a, a, a, a}} * b; }
HIPRT_HD HIPRT_FORCE_INLINE Float4 min4(Float4 a, Float4 b) {
  for (int i = 0; i < 4; ++i) a[i] = a[i] < b[i] ? a[i] : b[i];
  return a;
}
HIPRT_HD HIPRT_FORCE_INLINE Float4 max4(Float4 a, Float4 b) {
  for (int i = 0; i < 4; ++i) a[i] = a[i] > b[i] ? a[i] : b[i];
  return a;
}
/// In each lane x where a <= b, else y.
HIPRT_HD HIPRT_FORCE_INLINE Float4 where_not_above(Float4 a, Float4 b, Float4 x, Float4 y) {
  for (int i = 0; i < 3; ++i) x[i] = a[i] <= b[i] ? x[i] : y[i];
  return x;
}
#else
/// Four floats in the compiler's vector type. The fourth is ignored.
typedef float Float4 __attribute__((vector_size(16)));

HIPRT_HD HIPRT_FORCE_INLINE Float4 min4(Float4 a, Float4 b) { return a < b ? a : b; }
HIPRT_HD HIPRT_FORCE_INLINE Float4 max4(Float4 a, Float4 b) { return a > b ? a : b; }
/// In each lane x where a <= b, else y.
HIPRT_HD HIPRT_FORCE_INLINE Float4 where_not_above(Float4 a, Float4 b, Float4 x, Float4 y) { return a <= b ? x : y; }
#endif

/// A box in vector registers. Of two equal corners add() takes the new one and grow() keeps the old one: the sign of a
/// zero may differ.
struct SimdBox {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  Float4 min = {kInfinity, kInfinity, kInfinity, kInfinity};
  Float4 max = {-kInfinity, -kInfinity, -kInfinity, -kInfinity};

  HIPRT_HD HIPRT_FORCE_INLINE void add(const SimdBox& other) {
    min = min4(min, other.min);
    max = max4(max, other.max);
  }
  HIPRT_HD HIPRT_FORCE_INLINE void add(Float4 point) {
    min = min4(min, point);
    max = max4(max, point);
  }
  HIPRT_HD HIPRT_FORCE_INLINE bool empty() const { return !(min[0] <= max[0]); }
};

#if defined(__CUDACC__)
}  // namespace cuda_vectors
#endif

/// Half the surface area; 0 for the empty box. Halved edges keep sums of areas finite up to coordinates of 2^62.
HIPRT_HD HIPRT_FORCE_INLINE float half_area(const SimdBox& box) {
  const Float4 d = box.max - box.min;
  return box.empty() ? 0.0f : d[0] * (d[1] + d[2]) + d[1] * d[2];
}

HIPRT_HD HIPRT_FORCE_INLINE SimdBox to_simd(const Box& box) {
  return SimdBox{Float4{box.min[0], box.min[1], box.min[2], 0.0f}, Float4{box.max[0], box.max[1], box.max[2], 0.0f}};
}

HIPRT_HD HIPRT_FORCE_INLINE Box to_box(const SimdBox& box) {
  return Box{{box.min[0], box.min[1], box.min[2]}, {box.max[0], box.max[1], box.max[2]}};
}

/// The fastest form of a box for calculations: vector registers on hosts, six floats on devices.
struct FastBox {
#if HIPRT_DEVICE_CODE
  Box box = empty_box();

  HIPRT_HD HIPRT_FORCE_INLINE void add(const FastBox& other) { grow(box, other.box); }
  /// @pre not empty
  HIPRT_HD HIPRT_FORCE_INLINE float half_area() const { return build::half_area(box); }
#else
  SimdBox box;

  HIPRT_FORCE_INLINE void add(const FastBox& other) { box.add(other.box); }
  /// @pre not empty
  HIPRT_FORCE_INLINE float half_area() const {
    const Float4 d = box.max - box.min;
    return d[0] * (d[1] + d[2]) + d[1] * d[2];
  }
#endif
};

}  // namespace hiprt::build
