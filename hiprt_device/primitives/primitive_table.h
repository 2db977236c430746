#pragma once
/// Custom primitives of a scene: a compile-time list of functors. The compiler can inline the dispatch; there are no
/// function pointers.
///
///     using Hair = hiprt::PrimitiveList<hiprt::SphereSet, hiprt::RoundCurveSet>;  // custom types 0 and 1
///     Hair primitives{{spheres}, {vertices, first_vertex}};
///     hiprt::ClosestHit<P, hiprt::NoFilter, Hair> query(scene, ray, stack, {}, primitives);
///
/// PrimitiveTable has one list per ray type: HIPRT's table of types and ray types (HPG 2024).

#include <hiprt_device/filter.h>
#include <hiprt_device/instances/path_reader.h>
#include <hiprt_device/primitives/custom_point.h>
#include <hiprt_device/primitives/primitive.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The primitive to intersect.
struct PrimitiveId {
  std::uint32_t geometry;             ///< Number of the geometry in the scene, or in the object that has it.
  std::uint32_t primitive;            ///< Within the geometry.
  std::uint32_t object = kInvalidId;  ///< In an instance: the object's number (InstanceRecord::object).
};

/// The same with the instances that lead to the primitive: depth(), path() and instance_id(level). Functors get this
/// type. One that reads them takes the parameter as a template: `const auto& id`.
/// @tparam Levels of the traversal.
template <class Levels> struct PathPrimitiveId : PrimitiveId, PathReader<Levels> {
  HIPRT_HD HIPRT_FORCE_INLINE PathPrimitiveId(const PrimitiveId& id, const SceneView& scene, const Levels& levels)
      : PrimitiveId(id), PathReader<Levels>(scene, levels) {}
};

namespace primitive_detail {

template <class Real> using Report = bool (*)(const BasicCustomHit<Real>&);

template <class T, class Real>
concept TakesPrimitive = requires(const T& functor, const BasicRay<Real>& ray, Real t, std::uint32_t primitive,
                                  Report<Real> report) {
  { functor.intersect(ray, t, t, primitive, report) } -> std::same_as<bool>;
};
template <class T, class Real>
concept TakesId = requires(const T& functor, const BasicRay<Real>& ray, Real t, PrimitiveId id, Report<Real> report) {
  { functor.intersect(ray, t, t, id, report) } -> std::same_as<bool>;
};

template <class T>
concept MeasuresPrimitive = requires(const T& functor, const PointInObject& at, std::uint32_t primitive) {
  { functor.closest(at, primitive) } -> std::same_as<CustomPoint>;
};
template <class T>
concept MeasuresId = requires(const T& functor, const PointInObject& at, PrimitiveId id) {
  { functor.closest(at, id) } -> std::same_as<CustomPoint>;
};

}  // namespace primitive_detail

/// A functor with `bool intersect(ray, tmin, tmax, id, report) const`.
///
/// id is a PrimitiveId, or a template parameter that also tells the instances (PathPrimitiveId). For a type with one
/// geometry it may be the std::uint32_t number of the primitive. intersect()
/// calls report(CustomHit) for each crossing of the ray in [tmin, tmax] and returns false as soon as report does.
/// Every call must report the same crossing at the same t, with the same bits. The traversal discards hits outside
/// [tmin, tmax].
///
/// The functor may have `FilterResult filter(ray, hit) const`, an intersection filter (filter.h) for its type.
///
/// For DoubleRays it takes a RayD, tmin and tmax in double, and reports a CustomHitD. A template of Real serves both.
template <class T, class Real = float>
concept CustomPrimitive = primitive_detail::TakesPrimitive<T, Real> || primitive_detail::TakesId<T, Real>;

/// A functor with `CustomPoint closest(const PointInObject& at, id) const`, for point queries. id is as for
/// intersect().
///
/// It returns the closest point of the primitive, in the object's space. It keeps three promises, else points are
/// missed, and results depend on the tree:
/// - The same primitive, point and time always give the same bits. If the squared distance is beyond
///   at.limit_squared, it may return CustomPoint{} instead.
/// - The distance is at least that of the primitive's box, less 2^-43 of the distance of the box's farthest corner.
/// - The closest point is in the box, or as near to it.
template <class T>
concept DistancePrimitive = primitive_detail::MeasuresPrimitive<T> || primitive_detail::MeasuresId<T>;

/// The requirement of a traversal's custom primitives.
/// @tparam Real of the rays.
template <class T, class Real = float>
concept PrimitiveSet = requires(const T& set, const BasicRay<Real>& ray, Real t, PrimitiveId id,
                                const BasicHit<Real>& hit, primitive_detail::Report<Real> report) {
  { T::kCount } -> std::convertible_to<unsigned>;
  { set.intersect(0u, ray, t, t, id, report) } -> std::same_as<bool>;
  { set.filter(0u, ray, hit) } -> std::same_as<FilterResult>;
};

/// The requirement of a point query's custom primitives.
template <class T>
concept DistanceSet = requires(const T& set, const PointInObject& at, PrimitiveId id) {
  { T::kCount } -> std::convertible_to<unsigned>;
  { set.closest(0u, at, id) } -> std::same_as<CustomPoint>;
};

/// Whether a set's hits count at any t, and without the query's filter (T::kAnyT). For hiprt_device/compat.
///
/// The rule is HIPRT's. Such a set reports at most one hit per primitive. A closest-hit query takes each and cuts the
/// ray there. The set's least_t is the least t of triangles; boxes are tested from the ray's tmin on.
template <class T> inline constexpr bool kCountsAnyT = requires { requires T::kAnyT; };

/// Functor i is for custom type i (CustomGeometry::type). Primitives of other types are never hit.
template <class... Functors> struct PrimitiveList;

template <> struct PrimitiveList<> {
  static constexpr unsigned kCount = 0;
  template <class Real, class Id, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(unsigned, const BasicRay<Real>&, std::type_identity_t<Real>,
                                             std::type_identity_t<Real>, const Id&, Report&&) const {
    return true;
  }
  template <class Real, class HitType>
  HIPRT_HD HIPRT_FORCE_INLINE FilterResult filter(unsigned, const BasicRay<Real>&, const HitType&) const {
    return FilterResult::kAccept;
  }
  template <class Id> HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(unsigned, const PointInObject&, const Id&) const {
    return {};
  }
};

template <class First, class... Others> struct PrimitiveList<First, Others...> {
  static_assert(CustomPrimitive<First> || CustomPrimitive<First, double> || DistancePrimitive<First>,
                "hiprt: PrimitiveList: a functor needs bool intersect(ray, tmin, tmax, id, report) const; see concept "
                "CustomPrimitive. For point queries it needs CustomPoint closest(at, id) const");
  static constexpr unsigned kCount = 1 + sizeof...(Others);
  First first;
  PrimitiveList<Others...> others{};

  PrimitiveList() = default;
  /// One functor per type, in the order of types.
  HIPRT_HD constexpr PrimitiveList(const First& of_type_0, const Others&... of_next_types)
      : first(of_type_0), others(of_next_types...) {}

  template <class Real, class Id, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(unsigned type, const BasicRay<Real>& ray, std::type_identity_t<Real> tmin,
                                             std::type_identity_t<Real> tmax, const Id& id, Report&& report) const {
    static_assert(CustomPrimitive<First, Real>,
                  "hiprt: PrimitiveList: a primitive has no intersect() for this query's rays (float or double)");
    if (type != 0) return others.intersect(type - 1, ray, tmin, tmax, id, report);
    if constexpr (primitive_detail::TakesId<First, Real>)
      return first.intersect(ray, tmin, tmax, id, report);
    else
      return first.intersect(ray, tmin, tmax, id.primitive, report);
  }
  template <class Real, class HitType>
  HIPRT_HD HIPRT_FORCE_INLINE FilterResult filter(unsigned type, const BasicRay<Real>& ray, const HitType& hit) const {
    if (type != 0) return others.filter(type - 1, ray, hit);
    if constexpr (requires { first.filter(ray, hit); }) return first.filter(ray, hit);
    static_assert(
        !requires { first.filter(Ray{}, Hit{}); } || std::is_same_v<Real, float>,
        "hiprt: PrimitiveList: a primitive's filter does not take double rays");
    return FilterResult::kAccept;
  }
  template <class Id>
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(unsigned type, const PointInObject& at, const Id& id) const {
    static_assert(DistancePrimitive<First>,
                  "hiprt: PrimitiveList: a primitive has no CustomPoint closest(at, id) const for this point query; "
                  "see concept DistancePrimitive");
    if (type != 0) return others.closest(type - 1, at, id);
    if constexpr (primitive_detail::MeasuresId<First>)
      return first.closest(at, id);
    else
      return first.closest(at, id.primitive);
  }
};

template <class... Functors> PrimitiveList(const Functors&...) -> PrimitiveList<Functors...>;

/// For scenes without custom primitives.
using NoPrimitives = PrimitiveList<>;

/// One PrimitiveList per ray type.
template <class... Rows> struct PrimitiveTable;

template <> struct PrimitiveTable<> {
  static constexpr unsigned kCount = 0;
  template <class Visit> HIPRT_HD HIPRT_FORCE_INLINE auto with_row(unsigned, Visit&& visit) const {
    return visit(NoPrimitives{});
  }
};

template <class Row, class... Others> struct PrimitiveTable<Row, Others...> {
  static_assert(PrimitiveSet<Row>, "hiprt: PrimitiveTable: a row must be a PrimitiveList; see concept PrimitiveSet");
  static constexpr unsigned kCount =
      Row::kCount > PrimitiveTable<Others...>::kCount ? Row::kCount : PrimitiveTable<Others...>::kCount;
  Row row;
  PrimitiveTable<Others...> others{};

  PrimitiveTable() = default;
  /// One list per ray type, in the order of ray types.
  HIPRT_HD constexpr PrimitiveTable(const Row& of_type_0, const Others&... of_next_types)
      : row(of_type_0), others(of_next_types...) {}

  /// Calls visit(row of the ray type).
  template <class Visit> HIPRT_HD HIPRT_FORCE_INLINE auto with_row(unsigned ray_type, Visit&& visit) const {
    return ray_type == 0 ? visit(row) : others.with_row(ray_type - 1, visit);
  }
};

template <class... Rows> PrimitiveTable(const Rows&...) -> PrimitiveTable<Rows...>;

/// A table for one ray: the PrimitiveSet of a ray type that is chosen at run time.
template <class Table> struct TableRow {
  static constexpr unsigned kCount = Table::kCount;
  Table table;
  unsigned ray_type = 0;  ///< Row of the table. Rays of a type beyond the last meet no custom primitive.

  template <class Real, class Id, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(unsigned type, const BasicRay<Real>& ray, std::type_identity_t<Real> tmin,
                                             std::type_identity_t<Real> tmax, const Id& id, Report&& report) const {
    return table.with_row(ray_type, [&](const auto& row) { return row.intersect(type, ray, tmin, tmax, id, report); });
  }
  template <class Real, class HitType>
  HIPRT_HD HIPRT_FORCE_INLINE FilterResult filter(unsigned type, const BasicRay<Real>& ray, const HitType& hit) const {
    return table.with_row(ray_type, [&](const auto& row) { return row.filter(type, ray, hit); });
  }
  template <class Id>
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(unsigned type, const PointInObject& at, const Id& id) const {
    return table.with_row(ray_type, [&](const auto& row) { return row.closest(type, at, id); });
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
