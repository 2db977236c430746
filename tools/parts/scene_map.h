#pragma once
/// The objects of a scene of instances: where they are, what they need, and which of them emit light.

#include <tools/parts/split_scene.h>
#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/surface/surface.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/buffer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace hiprt::tools {

/// A box in double that may be empty.
struct Bounds {
  std::array<double, 3> min{kInfinity, kInfinity, kInfinity}, max{-kInfinity, -kInfinity, -kInfinity};

  bool empty() const { return min[0] > max[0]; }
  double center(unsigned axis) const { return empty() ? 0.0 : 0.5 * min[axis] + 0.5 * max[axis]; }
  void add(const std::array<double, 3>& point);
  void add(const Bounds& other);
  /// Of all corners after a transform.
  Bounds transformed(const Transform& transform) const;

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
};

/// About where an instance is. Of a moving one: where its first key puts it, without rotation.
Transform transform_of(const build::Instance& instance);

/// What is distributed: an instance of the scene, or one below opened groups.
struct ScenePiece {
  std::vector<std::uint32_t> path;  ///< From the scene on.
  std::uint32_t object;
  Transform to_scene;

  friend bool operator<(const ScenePiece& a, const ScenePiece& b) { return a.path < b.path; }
};

class SceneMap {
 public:
  /// @param files of build_objects(). @param surfaces of all objects; nullptr: none emits light.
  SceneMap(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces);

  bool shines(std::uint32_t object) const { return shines_[object] != 0; }
  bool is_group(std::uint32_t object) const { return object >= files_; }
  /// Index in SceneDescription::groups.
  std::size_t group_number(std::uint32_t object) const { return object - files_; }
  const SceneGroup& group(std::uint32_t object) const { return scene_.groups[group_number(object)]; }
  /// All objects that an object needs, and itself: files and groups.
  const std::vector<std::uint32_t>& reached(std::uint32_t object) const { return reached_[object]; }
  /// Memory of an object with all that it needs.
  std::uint64_t bytes(std::uint32_t object) const;
  std::uint64_t bytes_of_all() const;

  SplitInput split_input(std::span<const ScenePiece> pieces) const;

 private:
  void add_group(std::size_t object, const SceneGroup& group);

  const SceneDescription& scene_;
  std::size_t files_;
  std::vector<Bounds> bounds_;                       ///< Of each object, in its own space.
  std::vector<std::vector<std::uint32_t>> reached_;  ///< By each object, ascending.
  std::vector<std::uint64_t> bytes_;                 ///< Of each object without the objects below it.
  std::vector<char> shines_;
};

}  // namespace hiprt::tools
