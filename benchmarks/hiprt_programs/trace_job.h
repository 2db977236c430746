#pragma once
/// The kernels of bench_hiprt_programs: the same rays and the same tree, with HIPRT's names and with this library's.

#include <hiprt/hiprt_types.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <span>

namespace hiprt::bench {

/// Threads per block, as HIPRT's tutorials have them.
inline constexpr unsigned kNamesBlock = 64;
/// Entries per thread of global stacks, in shared and in global memory.
inline constexpr unsigned kSharedEntries = 16, kGlobalEntries = 64;

/// 8 bytes per ray, as bench_variants and the kernels of other libraries write.
struct NamesResult {
  float t;
  std::uint32_t primitive;  ///< kInvalidId: a miss.
};

/// What a kernel gets.
struct NamesJob {
  void* geometry;  ///< A hiprtGeometry.
  void* scene;     ///< A hiprtScene with the geometry as its only instance.
  /// What the handles point to: this library\'s programs pass views to kernels.
  SceneView geometry_view, scene_view;
  hiprtFuncTable table;  ///< nullptr. The compiler does not know.
  hiprtGlobalStackBuffer stack;
  hiprtGlobalStackBuffer instance_stack;
  const hiprtRay* rays;
  NamesResult* results;
  std::uint32_t count;
};

struct NamesKernel {
  const char* name;
  bool scene;    ///< Traces the scene, else the geometry.
  bool any_hit;  ///< Traces one hit of any distance, else the closest.
  const void* kernel;
};

/// This library's own queries. They are what the others are compared with: one per kind.
std::span<const NamesKernel> own_kernels();
/// HIPRT's classes.
std::span<const NamesKernel> names_kernels();

/// Writes the closest hits of a geometry, with normals: what rays are spawned from. A NamesJob and a Hit pointer.
const void* spawn_kernel();

}  // namespace hiprt::bench
