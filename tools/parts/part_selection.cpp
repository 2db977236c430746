#include <tools/parts/part_selection.h>

#include <map>
#include <set>
#include <utility>

namespace hiprt::tools {
namespace {

/// Makes the groups of a part: those of the scene with the instances that lead to its pieces.
class Selector {
 public:
  Selector(const SceneDescription& scene, const SceneMap& map, std::span<const ScenePiece> pieces)
      : scene_(scene), map_(map) {
    std::set<std::uint32_t> files;
    for (const ScenePiece& piece : pieces)
      for (const std::uint32_t object : map.reached(piece.object))
        if (!map.is_group(object)) files.insert(object);
    selection_.files.assign(files.begin(), files.end());
    for (std::uint32_t i = 0; i < selection_.files.size(); ++i) whole_[selection_.files[i]] = i;
    add(part_of(scene.groups.size() - 1, pieces, 0));
  }

  SceneSelection take() { return std::move(selection_); }

 private:
  /// The instances of a group that lead to pieces. @param depth of the group on their paths.
  SceneSelection::Group part_of(std::size_t original, std::span<const ScenePiece> pieces, std::size_t depth) {
    SceneSelection::Group group{original, {}, {}};
    while (!pieces.empty()) {
      const std::uint32_t instance = pieces.front().path[depth];
      std::size_t count = 0;
      while (count < pieces.size() && pieces[count].path[depth] == instance) ++count;
      const std::uint32_t object = scene_.groups[original].instances[instance].object;
      const bool ends = pieces.front().path.size() == depth + 1;
      group.instances.push_back(instance);
      group.objects.push_back(ends ? whole(object)
                                   : add_once(part_of(map_.group_number(object), pieces.first(count), depth + 1)));
      pieces = pieces.subspan(count);
    }
    return group;
  }
  /// An object with all that is below it.
  std::uint32_t whole(std::uint32_t object) {
    if (const auto found = whole_.find(object); found != whole_.end()) return found->second;
    const auto& instances = map_.group(object).instances;
    SceneSelection::Group group{map_.group_number(object), {}, {}};
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      group.instances.push_back(i);
      group.objects.push_back(whole(instances[i].object));
    }
    const std::uint32_t number = add_once(std::move(group));
    whole_[object] = number;
    return number;
  }
  std::uint32_t add_once(SceneSelection::Group group) {
    const auto found = known_.find(group);
    if (found != known_.end()) return found->second;
    const auto number = static_cast<std::uint32_t>(selection_.files.size() + selection_.groups.size());
    known_.emplace(group, number);
    add(std::move(group));
    return number;
  }
  void add(SceneSelection::Group group) { selection_.groups.push_back(std::move(group)); }

  const SceneDescription& scene_;
  const SceneMap& map_;
  SceneSelection selection_;
  std::map<std::uint32_t, std::uint32_t> whole_;          ///< New numbers of whole objects.
  std::map<SceneSelection::Group, std::uint32_t> known_;  ///< Parts of groups that are there.
};

/// The surfaces of some objects, with the materials and textures that they use.
class SurfaceSelection {
 public:
  SurfaceSelection(const SceneSurfaces& all, std::span<const std::uint32_t> objects) : all_(all) {
    for (const std::uint32_t object : objects) result_.objects.push_back(all.objects[object]);
    for (auto& object : result_.objects)
      for (GeometrySurface& geometry : object) {
        for (std::uint32_t& material : geometry.materials) material = new_material(material);
        if (geometry.shape_material) geometry.shape_material = new_material(*geometry.shape_material);
      }
  }

  SceneSurfaces take() { return std::move(result_); }

 private:
  std::uint32_t new_material(std::uint32_t old) {
    if (materials_.empty()) materials_.resize(all_.materials.size(), kInvalidId);
    if (materials_[old] != kInvalidId) return materials_[old];
    Material material = all_.materials[old];
    for (TextureUse* use :
         {&material.base_color_texture, &material.metallic_roughness_texture, &material.emission_texture})
      if (use->texture < all_.textures.size()) use->texture = new_texture(use->texture);
    materials_[old] = static_cast<std::uint32_t>(result_.materials.size());
    result_.materials.push_back(std::move(material));
    return materials_[old];
  }
  std::uint32_t new_texture(std::uint32_t old) {
    if (textures_.empty()) textures_.resize(all_.textures.size(), kInvalidId);
    if (textures_[old] != kInvalidId) return textures_[old];
    textures_[old] = static_cast<std::uint32_t>(result_.textures.size());
    result_.textures.push_back(all_.textures[old]);
    return textures_[old];
  }

  const SceneSurfaces& all_;
  SceneSurfaces result_;
  std::vector<std::uint32_t> materials_, textures_;  ///< New numbers by the old ones.
};

}  // namespace

SceneSelection select(const SceneDescription& scene, const SceneMap& map, std::span<const ScenePiece> pieces) {
  return Selector(scene, map, pieces).take();
}

SceneSurfaces select(const SceneSurfaces& all, std::span<const std::uint32_t> objects) {
  return SurfaceSelection(all, objects).take();
}

}  // namespace hiprt::tools
