#pragma once
/// One query of a batch, by one thread of a GPU. The host generates the kernels, which name the policies.

#include <hiprt_build/python/gpu/device/batch.h>
#include <hiprt_build/python/gpu/device/tracer.h>

namespace hiprt::python::gpu {

template <class Real> HIPRT_HD inline void store(void* to, std::uint64_t i, Real value) {
  static_cast<Real*>(to)[i] = value;
}
template <class Real> HIPRT_HD inline void store(void* to, std::uint64_t i, const BasicVec3<Real>& value) {
  for (int axis = 0; axis < 3; ++axis) static_cast<Real*>(to)[3 * i + static_cast<unsigned>(axis)] = value[axis];
}

/// The closest hit of ray @p i.
template <class P, class Primitives>
HIPRT_HD inline void answer(const SceneView& scene, const CastJob& job, std::uint64_t i) {
  using Real = typename P::Real;
  typename P::Stack::Memory stack;
  const auto ray = ray_of<Real>(job.rays, i);
  const auto hit =
      ClosestHit<P, NoFilter, Primitives>(scene, ray, stack, {}, make_primitives<Primitives>(scene)).next_hit();
  store<Real>(job.t, i, hit.t);
  store<Real>(job.u, i, hit.u);
  store<Real>(job.v, i, hit.v);
  job.geometry[i] = hit.geometry;
  job.primitive[i] = hit.primitive;
  store<Real>(job.normal, i, hit.normal);
  job.error[i] = hit.error;
  store_path<P>(hit, job.paths + i * scene.levels, scene.levels);
}

/// Whether ray @p i hits anything.
template <class P, class Primitives>
HIPRT_HD inline void answer(const SceneView& scene, const OccludedJob& job, std::uint64_t i) {
  using Tracer = WithoutSurface<P>;
  typename P::Stack::Memory stack;
  const auto ray = ray_of<typename P::Real>(job.rays, i);
  job.result[i] = OneHit<Tracer, NoFilter, Primitives>(scene, ray, stack, {}, make_primitives<Primitives>(scene))
                      .next_hit()
                      .found();
}

/// The number of triangles that ray @p i hits.
template <class P, class Primitives>
HIPRT_HD inline void answer(const SceneView& scene, const CountJob& job, std::uint64_t i) {
  using Tracer = WithoutSurface<P>;
  typename P::Stack::Memory stack;
  const auto ray = ray_of<typename P::Real>(job.rays, i);
  AllHits<Tracer, NoFilter, Primitives> query(scene, ray, stack, {}, make_primitives<Primitives>(scene));
  std::uint32_t count = 0;
  while (query.next_hit().found()) ++count;
  job.result[i] = count;
}

/// The closest point of the scene's triangles to point @p i.
/// @tparam P in double. @tparam Real of the results.
template <class P, class Real>
HIPRT_HD inline void answer_point(const SceneView& scene, const PointJob& job, std::uint64_t i) {
  typename P::Stack::Memory stack;
  const auto near = closest_point<P>(scene, point_of<Real>(job, i), typename P::Stack::Storage(stack));
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  store<Real>(job.distance, i, static_cast<Real>(near.distance()));
  store<Real>(job.nearest, i, BasicVec3<Real>(near.found() ? near.point : BasicVec3<double>(kNone)));
  store<Real>(job.u, i, static_cast<Real>(near.u));
  store<Real>(job.v, i, static_cast<Real>(near.v));
  job.geometry[i] = near.geometry;
  job.primitive[i] = near.primitive;
  job.feature[i] = static_cast<std::uint8_t>(near.feature);
  store_path<P>(near, job.paths + i * scene.levels, scene.levels);
}

}  // namespace hiprt::python::gpu
