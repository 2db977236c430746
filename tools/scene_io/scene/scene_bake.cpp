#include <tools/scene_io/scene/scene_bake.h>

#include <tools/base/memory_limit.h>
#include <tools/scene_io/scene/scene_flatten.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

bool is_finite(const build::Affine& affine) {
  return std::all_of(&affine.row[0][0], &affine.row[0][0] + 12, [](float x) { return std::isfinite(x); });
}

bool is_singular(const build::Instance& instance) {
  return instance.motion == nullptr && is_finite(instance.to_scene) && !build::is_invertible(instance.to_scene);
}

class Baker {
 public:
  explicit Baker(const SceneDescription& scene) : scene_(scene) {}

  build::Result<BakedInstances> bake() {
    for (const SceneGroup& group : scene_.groups) {
      groups_.emplace_back();
      for (std::size_t i = 0; i < group.instances.size(); ++i) {
        const build::Instance& instance = group.instances[i];
        if (!is_singular(instance)) {
          groups_.back().push_back(instance);
          continue;
        }
        auto flat = flatten_object(scene_, instance.object, to_double(instance.to_scene), instance.mask);
        if (flat) {
          if (baked_.instances++ == 0) baked_.first = group.location + "[" + std::to_string(i) + "]";
          replace(instance, std::move(*flat));
        } else if (flat.error().code == build::ErrorCode::kInvalidInput) {
          groups_.back().push_back(instance);
        } else {
          return tl::unexpected(flat.error());
        }
      }
    }
    return baked_;
  }

  /// Puts what was made into the scene that it was made of.
  void apply(SceneDescription& scene) {
    const std::size_t objects = scene.objects.size(), groups = scene.groups.size();
    for (std::size_t g = 0; g < groups; ++g) {
      scene.groups[g].instances = std::move(groups_[g]);
      for (build::Instance& instance : scene.groups[g].instances) {
        if (instance.object >= objects + groups)
          instance.object -= static_cast<std::uint32_t>(groups);
        else if (instance.object >= objects)
          instance.object += static_cast<std::uint32_t>(objects_.size());
      }
    }
    std::move(objects_.begin(), objects_.end(), std::back_inserter(scene.objects));
    std::move(meshes_.begin(), meshes_.end(), std::back_inserter(scene.meshes));
  }

 private:
  /// Until apply() new objects have numbers after all groups.
  void replace(const build::Instance& instance, std::vector<FlatGeometry>&& flat) {
    std::map<std::uint32_t, SceneObject> of_mask;
    for (FlatGeometry& geometry : flat) {
      SceneObject& object = of_mask[geometry.mask];
      if (object.meshes.empty()) object.name = *geometry.name;
      object.meshes.push_back(scene_.meshes.size() + meshes_.size());
      baked_.triangles += geometry.triangles.size();
      meshes_.push_back(to_mesh(scene_, std::move(geometry)));
    }
    for (auto& [mask, object] : of_mask) {
      build::Instance& made = groups_.back().emplace_back(instance);
      made.object = static_cast<std::uint32_t>(scene_.objects.size() + scene_.groups.size() + objects_.size());
      made.to_scene = {};
      made.mask = mask;
      objects_.push_back(std::move(object));
    }
  }

  const SceneDescription& scene_;
  std::vector<std::vector<build::Instance>> groups_;
  std::vector<SceneObject> objects_;
  std::vector<Mesh> meshes_;
  BakedInstances baked_;
};

}  // namespace

build::Result<BakedInstances> bake_singular(SceneDescription& scene) {
  try {
    Baker baker(scene);
    auto baked = baker.bake();
    if (baked && baked->instances != 0) baker.apply(scene);
    return baked;
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(scene.path, "for its instances without inverse", failure));
  }
}

}  // namespace hiprt::tools
