#pragma once
/// Axis-aligned boxes in vector registers, for the builder's inner loops. Internal.

#include <hiprt_device/format/node.h>

#include <cstring>
#include <limits>

namespace hiprt::build {

/// Four floats in the compilers' vector type; the fourth is ignored.
typedef float Float4 __attribute__((vector_size(16)));

inline Float4 load4(const float* p) {
  Float4 result;
  std::memcpy(&result, p, sizeof(result));
  return result;
}
inline Float4 min4(Float4 a, Float4 b) { return a < b ? a : b; }
inline Float4 max4(Float4 a, Float4 b) { return a > b ? a : b; }

struct Aabb {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  Float4 min = {kInfinity, kInfinity, kInfinity, kInfinity};
  Float4 max = {-kInfinity, -kInfinity, -kInfinity, -kInfinity};

  void add(const Aabb& other) {
    min = min4(min, other.min);
    max = max4(max, other.max);
  }
  void add(Float4 point) {
    min = min4(min, point);
    max = max4(max, point);
  }
  bool empty() const { return !(min[0] <= max[0]); }
};

/// Half the surface area; 0 for the empty box. Halved edges keep sums of areas finite up to coordinates of 2^62.
inline float half_area(const Aabb& box) {
  const Float4 d = box.max - box.min;
  return box.empty() ? 0.0f : d[0] * (d[1] + d[2]) + d[1] * d[2];
}

inline Box to_box(const Aabb& box) {
  return Box{{box.min[0], box.min[1], box.min[2]}, {box.max[0], box.max[1], box.max[2]}};
}

}  // namespace hiprt::build
