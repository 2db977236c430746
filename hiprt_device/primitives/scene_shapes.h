#pragma once
/// Spheres, round linear curves and moving triangles of a scene's file.

#include <hiprt_device/primitives/moving_triangle.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The shapes of a scene's file and of its objects' files: a PrimitiveSet that needs only the scene.
///
///     hiprt::ClosestHit<P, hiprt::NoFilter, hiprt::SceneShapes> query(scene, ray, stack, {},
///     hiprt::SceneShapes(scene));
///
/// It handles all custom types. In a PrimitiveList it is the functor of one type, beside functors of the program:
/// PrimitiveList<SceneShapes, Grass>.
///
/// Queries refuse a scene with custom primitives whose file has no shapes at all (Hit::failed()). If the file has
/// some, custom geometries without shapes are never hit. SphereSet, RoundCurveSet and MovingTriangleSet describe the
/// hits.
class SceneShapes {
 public:
  static constexpr unsigned kCount = 256;

  HIPRT_HD HIPRT_FORCE_INLINE explicit SceneShapes(const SceneView& scene)
      : base_(scene.base), objects_(scene.objects), shapes_(scene.shapes) {}

  /// Whether the file has shapes, or the scene needs none.
  HIPRT_HD HIPRT_FORCE_INLINE bool covers(const SceneView& scene) const {
    return shapes_ != 0 || (scene.features & feature_bit(Feature::kCustom)) == 0;
  }

  /// As a PrimitiveSet.
  template <class Real, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(unsigned, const BasicRay<Real>& ray, std::type_identity_t<Real> tmin,
                                             std::type_identity_t<Real> tmax, PrimitiveId id, Report&& report) const {
    return intersect(ray, tmin, tmax, id, report);
  }
  template <class Real>
  HIPRT_HD HIPRT_FORCE_INLINE FilterResult filter(unsigned, const BasicRay<Real>&, const BasicHit<Real>&) const {
    return FilterResult::kAccept;
  }

  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(unsigned, const PointInObject& at, PrimitiveId id) const {
    return closest(at, id);
  }

  /// As a functor of a PrimitiveList.
  template <class Real, class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(const BasicRay<Real>& ray, std::type_identity_t<Real> tmin,
                                             std::type_identity_t<Real> tmax, PrimitiveId id, Report&& report) const {
    return visit(id, Intersect<Real, Report>{ray, tmin, tmax, id.primitive, report}, true);
  }
  HIPRT_HD HIPRT_FORCE_INLINE CustomPoint closest(const PointInObject& at, PrimitiveId id) const {
    return visit(id, Closest{at, id.primitive}, CustomPoint{});
  }

 private:
  // Functors, because NVRTC treats generic lambdas as host code.
  template <class Real, class Report> struct Intersect {
    const BasicRay<Real>& ray;
    Real tmin, tmax;
    std::uint32_t primitive;
    Report& report;
    template <class Set> HIPRT_HD HIPRT_FORCE_INLINE bool operator()(const Set& set) const {
      return set.intersect(ray, tmin, tmax, primitive, report);
    }
  };
  struct Closest {
    const PointInObject& at;
    std::uint32_t primitive;
    template <class Set> HIPRT_HD HIPRT_FORCE_INLINE CustomPoint operator()(const Set& set) const {
      return set.closest(at, primitive);
    }
  };

  /// @return visit(the geometry's SphereSet, RoundCurveSet or MovingTriangleSet); or @p nothing, if it has no shapes.
  template <class Visit, class Result>
  HIPRT_HD HIPRT_FORCE_INLINE Result visit(const PrimitiveId& id, const Visit& visit, const Result& nothing) const {
    if (shapes_ == 0) return nothing;
    const std::byte* file = base_;
    std::uint64_t records = shapes_;
    if (id.object != kInvalidId) {
      file += objects_[id.object].offset;
      records = reinterpret_cast<const std::uint64_t*>(base_ + shapes_)[id.object];
      if (records == 0) return nothing;
    }
    const ShapeRecord& shape = reinterpret_cast<const ShapeRecord*>(file + records)[id.geometry];
    const std::byte* points = file + shape.points;
    if (shape.kind == ShapeKind::kCurves)
      return visit(RoundCurveSet{reinterpret_cast<const CurveVertex*>(points),
                                 reinterpret_cast<const std::uint32_t*>(file + shape.segments)});
    if (shape.kind == ShapeKind::kSpheres) return visit(SphereSet{reinterpret_cast<const Sphere*>(points)});
    if (shape.kind == ShapeKind::kMovingTriangles) {
      constexpr std::uint32_t kStride = sizeof(ShapePoint) / sizeof(float);
      const auto* numbers = reinterpret_cast<const float*>(points);
      const std::uint32_t vertices = shape.point_count / shape.keys;
      return visit(MovingTriangleSet{{numbers, numbers + kStride - 1,
                                      reinterpret_cast<const std::uint32_t*>(file + shape.segments), vertices,
                                      shape.keys, kStride, kStride * vertices}});
    }
    return nothing;
  }

  const std::byte* base_;
  const ObjectRecord* objects_;
  std::uint64_t shapes_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
