#pragma once
/// Arrays of a batch of queries in the memory of a GPU: the host describes them, and kernels read and write them.
/// Plain members only. The host compiles this header too, so that both agree on the layout.

#include <hiprt_device/math/arithmetic.h>
#include <hiprt_device/query/point_search.h>
#include <hiprt_device/ray.h>

namespace hiprt::python::gpu {

/// Dimensions of a batch, after neighbours with a common stride are merged.
inline constexpr unsigned kMostDimensions = 4;

/// The dimension that varies fastest is the last. Unused ones have length 1.
struct BatchShape {
  std::uint64_t size;
  std::uint64_t lengths[kMostDimensions];
};

/// In bytes.
using Distance = long long;

enum class NumberKind : std::uint32_t { kFloat, kDouble, kUint32 };

/// Numbers or vectors of a batch, read in place. Strides are in bytes; 0: all queries along that dimension share them.
struct Column {
  const std::byte* first;  ///< nullptr: the values serve all queries. Numbers have one, vectors three.
  Distance strides[kMostDimensions];
  Distance component;  ///< From a component of a vector to the next.
  double values[3];
  NumberKind kind;
};

struct RayInput {
  BatchShape shape;
  Column origin, direction, tmin, tmax, mask, time;
};

/// Arrays without gaps. Reals are float, or double for double policies.
struct CastJob {
  RayInput rays;
  void *t, *u, *v;
  std::uint32_t *geometry, *primitive;
  void* normal;
  float* error;
  std::uint32_t* paths;  ///< SceneView::levels numbers per ray.
};

struct OccludedJob {
  RayInput rays;
  bool* result;
};

struct CountJob {
  RayInput rays;
  std::uint32_t* result;
};

struct PointJob {
  BatchShape shape;
  Column point, max_distance, mask, time;
  void *distance, *nearest, *u, *v;
  std::uint32_t *geometry, *primitive;
  std::uint8_t* feature;
  std::uint32_t* paths;
};

/// The place of a query in its batch.
struct BatchIndex {
  std::uint64_t at[kMostDimensions];

  HIPRT_HD BatchIndex(const BatchShape& shape, std::uint64_t i) {
    for (unsigned d = kMostDimensions - 1; d > 0; --d) {
      at[d] = 0;
      if (shape.lengths[d] == 1) continue;
      const std::uint64_t rest = i / shape.lengths[d];
      at[d] = i - rest * shape.lengths[d];
      i = rest;
    }
    at[0] = i;
  }
  HIPRT_HD const std::byte* in(const Column& column) const {
    Distance offset = 0;
    for (unsigned d = 0; d < kMostDimensions; ++d) offset += static_cast<Distance>(at[d]) * column.strides[d];
    return column.first + offset;
  }
};

/// Rounds to the nearest float, if Real is float.
template <class Real> HIPRT_HD inline Real rounded(double number) {
  if constexpr (sizeof(Real) == sizeof(double))
    return number;
  else
    return nearest_float(number);
}

template <class Real> HIPRT_HD inline Real number_at(NumberKind kind, const std::byte* from) {
  if (kind == NumberKind::kDouble) return rounded<Real>(*reinterpret_cast<const double*>(from));
  return static_cast<Real>(*reinterpret_cast<const float*>(from));
}

template <class Real> HIPRT_HD inline Real number_of(const Column& column, const BatchIndex& index) {
  if (column.first == nullptr) return rounded<Real>(column.values[0]);
  return number_at<Real>(column.kind, index.in(column));
}

template <class Real> HIPRT_HD inline BasicVec3<Real> vector_of(const Column& column, const BatchIndex& index) {
  if (column.first == nullptr)
    return {rounded<Real>(column.values[0]), rounded<Real>(column.values[1]), rounded<Real>(column.values[2])};
  const std::byte* const from = index.in(column);
  return {number_at<Real>(column.kind, from), number_at<Real>(column.kind, from + column.component),
          number_at<Real>(column.kind, from + 2 * column.component)};
}

HIPRT_HD inline std::uint32_t mask_of(const Column& column, const BatchIndex& index) {
  if (column.first == nullptr) return static_cast<std::uint32_t>(column.values[0]);
  return *reinterpret_cast<const std::uint32_t*>(index.in(column));
}

template <class Real> HIPRT_HD inline BasicRay<Real> ray_of(const RayInput& rays, std::uint64_t i) {
  const BatchIndex index(rays.shape, i);
  BasicRay<Real> ray;
  ray.origin = vector_of<Real>(rays.origin, index);
  ray.direction = vector_of<Real>(rays.direction, index);
  ray.tmin = number_of<Real>(rays.tmin, index);
  ray.tmax = number_of<Real>(rays.tmax, index);
  ray.mask = mask_of(rays.mask, index);
  ray.time = number_of<float>(rays.time, index);
  return ray;
}

/// @tparam Real float: numbers are rounded to the nearest float first.
template <class Real> HIPRT_HD inline PointQueryD point_of(const PointJob& job, std::uint64_t i) {
  const BatchIndex index(job.shape, i);
  PointQueryD query;
  query.point = BasicVec3<double>(vector_of<Real>(job.point, index));
  query.max_distance = static_cast<double>(number_of<Real>(job.max_distance, index));
  query.mask = mask_of(job.mask, index);
  query.time = number_of<float>(job.time, index);
  return query;
}

}  // namespace hiprt::python::gpu
