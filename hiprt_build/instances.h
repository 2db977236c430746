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
  std::uint32_t object = 0;          ///< Number of the object; see InstancedScene.
  Affine to_scene{};                 ///< From the object to the scene or group of the instance. Must have an inverse.
  std::uint32_t mask = 0xffffffffu;  ///< A ray sees the instance iff (ray.mask & mask) != 0.
  std::uint32_t id = 0;              ///< The program's own number (InstanceRecord::id).
  /// Queries do not call intersection filters inside this instance: all hits count (InstanceFlags::kNoFilter).
  bool without_filter = false;
  const Motion* motion = nullptr;  ///< If set, replaces to_scene. It must live until the scene is built.
};

/// Which boxes of an object are transformed to compute the box of its instance. Tighter boxes let fewer rays enter and
/// take longer to compute.
enum class InstanceBounds : unsigned {
  kRoot = 0,           ///< The box of the whole object.
  kChildren = 1,       ///< The boxes in the object's root node: up to 4.
  kGrandchildren = 2,  ///< The boxes in the nodes below it: up to 16.
  kPrimitives = 3,     ///< The triangles' corners, custom primitives and instances that affect the result.
};

/// How the trees over instances are built.
struct InstanceOptions {
  /// Options of the trees over instances. Every builder works. nodes is ignored: the objects' layout is used. Leaves
  /// hold one instance.
  BuildOptions tree{.builder = Builder::kHploc, .reinsertion_rounds = 8};
  InstanceBounds bounds = InstanceBounds::kGrandchildren;
  /// 1 to 64: how many leaves per instance the trees may have, on average. An opened instance has several leaves, and
  /// each leads rays to a part of the object (Benthin et al. 2017, "Improved two-level BVHs using partial
  /// re-braiding").
  /// The builder opens instances where the boxes of the parts have less area together than the box of the whole, and
  /// rays enter less often. Hits are the same.
  double opening_budget = 1.0;
  /// Opens the instances with the largest boxes without that condition. Faster where large instances lie in each other,
  /// such as an island under its forests. Up to 19 % slower elsewhere (H100).
  bool open_largest = false;
};

/// Objects by number: first the files, then the groups.
struct InstancedScene {
  /// BVH files without instances, all of one layout, as build() makes them or read_file() reads them. They are trusted:
  /// validate files of unknown origin first. Each is copied into the scene's file once.
  std::span<const std::span<const std::byte>> files;
  /// Instances of objects with lower numbers. Group g is object files.size() + g. The last group is the scene; it is no
  /// object.
  std::span<const std::span<const Instance>> groups;
};

/// @return whether an instance may have this transform. It must be finite and have an inverse that floats can hold. Its
/// computed condition number must be at most 2^40. Above 2^20 the computed number is a bound: transforms with a
/// condition up to 2^36.8 are accepted, transforms with 2^38.5 or more are not.
HIPRT_BUILD_API bool is_invertible(const Affine& to_scene);

/// Builds a scene of instances. The statistics are those of the scene's own tree, whose custom primitives are instances
/// or parts of opened instances. BuildStatistics::dropped_degenerate counts the instances of empty objects.
/// @return kInvalidInput with the group and instance if an object does not exist, or a transform is not finite or has
/// no inverse (with its determinant). Transforms between two keys of a motion are checked too. kTooLarge if the stack
/// of a traversal would be too large.
HIPRT_BUILD_API Result<Bvh> build_instances(const InstancedScene& scene, const InstanceOptions& options = {});

/// The same with one group: a scene with a top-level BVH and bottom-level BVHs.
HIPRT_BUILD_API Result<Bvh> build_instances(std::span<const std::span<const std::byte>> files,
                                            std::span<const Instance> instances, const InstanceOptions& options = {});

}  // namespace hiprt::build
