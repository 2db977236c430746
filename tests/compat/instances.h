#pragma once
/// Random scenes of instances for HIPRT's traversals.

#include <tests/compat/scenes.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <deque>

namespace hiprt::test {

/// Objects of triangles and instances of them, at one or two levels.
class Forest {
 public:
  Forest() = default;
  Forest(Random& random, unsigned objects, unsigned instances, bool moves) : Forest() {
    for (unsigned i = 0; i < objects; ++i) {
      meshes_.emplace_back(random, 40, build::BuildOptions{.builder = build::Builder::kHploc}, 0.6f);
      add_file(meshes_.back().bvh);
    }
    for (unsigned i = 0; i < instances; ++i) add_random(random, random.below(objects), moves);
  }

  /// @param bvh must outlive the scene.
  void add_file(const build::Bvh& bvh) { files_.push_back(bvh.buffer.bytes()); }
  void add_instance(const build::Instance& instance) { groups_.back().push_back(instance); }
  /// Makes a group of the instances so far, and instances of it.
  void add_level(Random& random, unsigned instances, bool moves) {
    const auto group = static_cast<std::uint32_t>(files_.size() + groups_.size() - 1);
    next_level();
    for (unsigned i = 0; i < instances; ++i) add_random(random, group, moves);
  }
  /// What is added from now on are instances of a new group.
  void next_level() { groups_.emplace_back(); }
  void build() {
    const std::vector<std::span<const build::Instance>> groups(groups_.begin(), groups_.end());
    auto bvh = build::build_instances(build::InstancedScene{files_, groups});
    INFO((bvh ? std::string() : bvh.error().message));
    REQUIRE(bvh.has_value());
    built_ = std::move(*bvh);
    view_ = built_.scene();
  }
  SceneView view() const { return view_; }
  /// Gives the geometry of an object a type: geomType + 1.
  void set_type(std::uint32_t object, std::uint32_t geom_type) {
    SceneView of_object;
    of_object.geometries = ObjectView(view_, view_.objects[object]).geometries;
    test::set_type(of_object, geom_type);
  }

  /// The normal of a hit's triangle, in the object.
  std::array<double, 3> normal_of(const hiprtHit& hit) const {
    std::size_t group = groups_.size() - 1;
    std::uint32_t object = 0;
    for (const std::uint32_t id : hit.instanceIDs) {
      if (id == hiprtInvalidValue) break;
      object = groups_[group][id].object;
      if (object >= files_.size()) group = object - files_.size();
    }
    return meshes_[object].normal(hit.primID);
  }

 private:
  void add_random(Random& random, std::uint32_t object, bool moves) {
    build::Instance instance{.object = object,
                             .to_scene = checks::random_affine(random, 0.8),
                             .mask = random.coin() ? ~0u : 1u << random.below(3)};
    if (moves && random.coin()) {
      build::MatrixKey first{0.0f, instance.to_scene}, second{1.0f, instance.to_scene};
      for (auto& row : second.to_scene.row) row[3] += random.uniform_float(-0.5, 0.5);
      motions_.push_back({.matrices = {first, second}});
      if (random.coin()) motions_.back().kind = MotionKind::kMatrix;
      instance.motion = &motions_.back();
    }
    add_instance(instance);
  }

  std::vector<std::vector<build::Instance>> groups_{1};
  std::deque<Triangles> meshes_;
  std::deque<build::Motion> motions_;
  std::vector<std::span<const std::byte>> files_;
  build::Bvh built_;
  SceneView view_;
};

}  // namespace hiprt::test
