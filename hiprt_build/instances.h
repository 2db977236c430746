#pragma once
/// Builds the file of a scene of instances from BVH files and transforms.
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
  /// Queries do not call intersection filters inside this instance: all hits count (InstanceFlags::kNoFilter).
  bool without_filter = false;
  const Motion* motion = nullptr;  ///< If set, replaces to_scene. It must live until the scene is built.
};

/// Which boxes of the object are transformed to make the box of an instance. Smaller boxes let fewer rays in and take
/// longer to make.
enum class InstanceBounds : unsigned {
  kRoot = 0,           ///< The object as a whole.
  kChildren = 1,       ///< The object's root node: up to 4.
  kGrandchildren = 2,  ///< The nodes below it: up to 16.
  kPrimitives = 3,     ///< All its triangles' corners, custom primitives and instances that matter for the result.
};

/// How the trees over instances are built.
struct InstanceOptions {
  /// Options of the trees over instances. Any builder. nodes is ignored: the objects' layout is used. Leaves hold one
  /// instance.
  BuildOptions tree{.builder = Builder::kHploc, .reinsertion_rounds = 8};
  InstanceBounds bounds = InstanceBounds::kGrandchildren;
  /// 1 to 64: leaves that the trees may have per instance, on average. The builder opens the instances with the largest
  /// boxes: each gets several leaves, from which rays enter parts of the object (Benthin et al. 2017, "Improved
  /// two-level BVHs using partial re-braiding"). Helps where instances overlap. Hits are the same.
  double opening_budget = 1.0;
};

/// Objects by number: first the files, then the groups.
struct InstancedScene {
  /// BVH files without instances, all of one layout, as build() makes them or read_file() reads them. They are trusted:
  /// validate files of unknown origin first. Each is copied into the scene's file once.
  std::span<const std::span<const std::byte>> files;
  /// Instances of objects with lower numbers. Group g is object files.size() + g; the last group is the scene, and no
  /// object.
  std::span<const std::span<const Instance>> groups;
};

/// @return whether an instance may have this transform: it is finite and has an inverse that floats can hold, and its
/// computed condition number is at most 2^40. Above 2^20 the computed number is a bound: transforms with a condition up
/// to 2^36.8 are accepted, those of 2^38.5 or more are not.
HIPRT_BUILD_API bool is_invertible(const Affine& to_scene);

/// Builds a scene of instances. The statistics are those of the scene's own tree, whose custom primitives are instances
/// or parts of opened instances. BuildStatistics::dropped_degenerate counts the instances of empty objects.
/// @return kInvalidInput with the group and instance for an object that does not exist, a transform that is not finite
/// or has no inverse (with its determinant), also on the way from one key to the next; kTooLarge if the stack of a
/// traversal would be.
HIPRT_BUILD_API Result<Bvh> build_instances(const InstancedScene& scene, const InstanceOptions& options = {});

/// The same with one group: a scene of two levels.
HIPRT_BUILD_API Result<Bvh> build_instances(std::span<const std::span<const std::byte>> files,
                                            std::span<const Instance> instances, const InstanceOptions& options = {});

}  // namespace hiprt::build
