#pragma once
/// Hits as HIPRT has them. Internal.

#include <hiprt/impl/scene_handles.h>
#include <hiprt_device/instances/object_view.h>
#include <hiprt_device/intersect/hit_surface.h>

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// A vector of this library as one of the compiler.
HIPRT_HD HIPRT_FORCE_INLINE hiprtFloat3 to_float3(const Vec3& v) { return hiprtFloat3{v.x, v.y, v.z}; }
/// A vector of the compiler as one of this library.
HIPRT_HD HIPRT_FORCE_INLINE Vec3 to_vec3(const hiprtFloat3& v) { return Vec3(v.x, v.y, v.z); }

/// a * d - b * c, rounded well where the products nearly cancel (Kahan).
HIPRT_HD HIPRT_FORCE_INLINE float minor(float a, float d, float b, float c) {
  const float product = b * c;
  return fused_multiply_add(a, d, -product) + fused_multiply_add(-b, c, product);
}

/// cross(v1 - v0, v2 - v0) of a leaf's triangle, in the object's space. Unlike Hit::normal it is not scaled.
template <class Layout> HIPRT_HD HIPRT_FORCE_INLINE Vec3 triangle_normal(const std::byte* record, unsigned triangle) {
  const auto& leaf = *reinterpret_cast<const typename Layout::Leaf*>(record);
  unsigned vertex[3] = {corner_vertex(triangle, 0), corner_vertex(triangle, 1), corner_vertex(triangle, 2)};
  to_mesh_order(vertex, leaf.info.triangle_ids >> (8 * triangle));
  const auto edge = [&](unsigned corner, unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
    return Layout::coordinate(leaf, vertex[corner], axis) - Layout::coordinate(leaf, vertex[0], axis);
  };
  const Vec3 a(edge(1, 0), edge(1, 1), edge(1, 2)), b(edge(2, 0), edge(2, 1), edge(2, 2));
  return Vec3(minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x));
}

/// Sets all instance numbers of a hit; levels without an instance are invalid.
template <class Path> HIPRT_HD HIPRT_FORCE_INLINE void set_instances(hiprtHit& hit, const Path& path) {
  for (uint32_t i = 0; i < hiprtMaxInstanceLevels; ++i) hit.instanceIDs[i] = hiprtInvalidValue;
  if constexpr (requires { path.instance[0]; }) {
    constexpr unsigned kLevels =
        sizeof(path.instance) / sizeof(path.instance[0]);  // NOLINT(bugprone-sizeof-expression)
    for (unsigned i = 0; i < kLevels; ++i)
      if (i < path.depth) hit.instanceIDs[i] = path.instance[i];
  }
}

/// A miss, with all members set.
HIPRT_HD HIPRT_FORCE_INLINE hiprtHit no_hit() {
  hiprtHit hit;
  set_instances(hit, InstancePath<0>{});
  hit.uv = hiprtFloat2{0.0f, 0.0f};
  hit.normal = hiprtFloat3{0.0f, 0.0f, 0.0f};
  return hit;
}

/// The first byte of the file of the object at the end of a path.
template <class Path>
HIPRT_HD HIPRT_FORCE_INLINE const std::byte* object_base(const SceneView& scene, const Path& path) {
  ObjectView view(scene);
  if constexpr (requires { path.instance[0]; }) {
    for_levels<hiprtMaxInstanceLevels, hiprtMaxInstanceLevels>(path.depth, [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
      view = ObjectView(scene, scene.objects[view.instances[path.instance[i]].object]);
    });
  }
  return view.base;
}

/// A result of a search.
/// @tparam kCustom whether there may be custom primitives.
/// @param leaf with the triangle; kInvalidRef: a custom primitive. Then hit.error has the bits of its primID.
template <class Layout, bool kCustom, class Result>
HIPRT_HD HIPRT_FORCE_INLINE hiprtHit to_hiprt(const SceneView& scene, const Result& found, NodeRef leaf) {
  hiprtHit hit = no_hit();
  if constexpr (requires { found.path; }) set_instances(hit, found.path);
  hit.uv = hiprtFloat2{found.u, found.v};
  hit.t = found.t;
  if (kCustom && leaf == kInvalidRef) {
    hit.primID = std::bit_cast<std::uint32_t>(found.error);
    hit.normal = to_float3(found.normal);
    return hit;
  }
  hit.primID = found.primitive;
  const std::byte* base = scene.base;
  if constexpr (requires { found.path; }) base = object_base(scene, found.path);
  hit.normal = to_float3(triangle_normal<Layout>(base + ref_offset(leaf), leaf & 1u));
  return hit;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
