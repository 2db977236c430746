#pragma once
/// BVH files and where their instances are in, a scene's file out.
///
///     std::vector<std::span<const std::byte>> objects{tree.buffer.bytes(), house.buffer.bytes()};
///     std::vector<hiprt::build::Instance> forest{{.object = 0, .to_scene = at(3, 0, 7)}, {.object = 1}};
///     auto scene = hiprt::build::build_instances(objects, forest);
///     hiprt::build::write_file("scene.bvh", scene->buffer.bytes());

#include <hiprt_build/build.h>
#include <hiprt_build/motion.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::build {

struct Instance {
  std::uint32_t object = 0;  ///< See InstancedScene.
  Affine to_scene{};         ///< From the object to the scene (or group) that has the instance. Any with an inverse.
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the instance iff (ray.mask & mask) != 0.
  std::uint32_t id = 0;              ///< The program's own number (InstanceRecord::id).
  /// Intersection filters are not asked about what is in it: all hits count (InstanceFlags::kNoFilter).
  bool without_filter = false;
  const Motion* motion = nullptr;  ///< If any, in place of to_scene; has to live until the scene is built.
};

/// What the box of an instance in its scene's tree is made of: the boxes, transformed, of ... Smaller boxes let fewer
/// rays in and take longer to make.
enum class InstanceBounds : unsigned {
  kRoot = 0,           ///< The object as a whole.
  kChildren = 1,       ///< The object's root node: up to 4.
  kGrandchildren = 2,  ///< The nodes below it: up to 16.
  kPrimitives = 3,     ///< All its triangles' corners, custom primitives and instances; but for those that lie inside
                       ///< the others.
};

/// How the trees over instances are built.
struct InstanceOptions {
  /// Of the trees over instances. builder: any; threads, progress, tool: as everywhere; nodes: what the objects have is
  /// taken; leaves hold one instance.
  BuildOptions tree{.builder = Builder::kHploc, .reinsertion_rounds = 8};
  InstanceBounds bounds = InstanceBounds::kGrandchildren;
  /// Leaves that the trees may have per instance, 1 to 64 on average: the instances with the largest boxes are opened,
  /// that is they are in several leaves, from which rays enter parts of the object (Benthin et al. 2017, "Improved
  /// two-level BVHs using partial re-braiding"). For instances that overlap. Hits are the same.
  double opening_budget = 1.0;
};

/// Objects by number: first the files, then the groups.
struct InstancedScene {
  /// Whole BVH files without instances, all of one layout, as build() makes them or read_file() reads them. They are
  /// trusted: files of unknown origin have to be validated before. Copied into the scene's file, each once.
  std::span<const std::span<const std::byte>> files;
  /// Instances of objects with lower numbers. Group g is object files.size() + g; the last group is the scene, and no
  /// object.
  std::span<const std::span<const Instance>> groups;
};

/// Whether an instance may have this place: it is finite and has an inverse that floats can hold, of a condition up to
/// 2^40 as it is computed: beyond 2^20 that is a bound, so that 2^36.8 is accepted for certain and 2^38.5 is not.
HIPRT_BUILD_API bool is_invertible(const Affine& to_scene);

/// Builds a scene of instances. Statistics are those of the scene's own tree: its custom primitives are instances, or
/// parts of opened ones.
/// Instances of empty objects are counted as dropped (BuildStatistics::dropped_degenerate).
/// @return kInvalidInput with the group and instance for an object that does not exist, a transform that is not finite
/// or has no inverse (with its determinant), also on the way from one key to the next; kTooLarge if the stack of a
/// traversal would be.
HIPRT_BUILD_API Result<Bvh> build_instances(const InstancedScene& scene, const InstanceOptions& options = {});

/// The same of one group: two levels.
HIPRT_BUILD_API Result<Bvh> build_instances(std::span<const std::span<const std::byte>> files,
                                            std::span<const Instance> instances, const InstanceOptions& options = {});

}  // namespace hiprt::build
