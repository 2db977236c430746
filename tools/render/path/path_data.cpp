#include <tools/render/path/path_data.h>

#include <tools/render/image/color.h>
#include <tools/render/scene/path_surface.h>
#include <tools/render/scene/trace_limits.h>
#include <tools/render/studio/studio.h>

#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/math/vec_functions.h>

#include <algorithm>

namespace hiprt::tools {
namespace {

constexpr std::uint64_t kMostLights = std::uint64_t{1} << 26;

PathTextureUse use_of(const TextureUse& use, std::size_t textures) {
  PathTextureUse result{use.texture < textures ? use.texture : kInvalidId, use.wrap_u, use.wrap_v, {}};
  for (unsigned row = 0; row < 2; ++row)
    for (unsigned column = 0; column < 3; ++column) result.matrix[row][column] = use.matrix[3 * row + column];
  return result;
}

Vec3 vec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

PathMaterial clay() {
  const PathTextureUse none{kInvalidId, TextureWrap::kRepeat, TextureWrap::kRepeat, {}};
  return {Studio::clay(), 1.0f, Vec3(0.0f), 0.0f, 0.0f, 1.0f, none, none, none};
}

void add_materials(const SceneSurfaces& surfaces, PathData& data) {
  for (const Material& m : surfaces.materials) {
    const auto use = [&](const TextureUse& of) { return use_of(of, surfaces.textures.size()); };
    data.materials.push_back({vec3(m.base_color), m.alpha, vec3(m.emission), m.alpha_cutoff, m.metallic, m.roughness,
                              use(m.base_color_texture), use(m.metallic_roughness_texture), use(m.emission_texture)});
  }
}

build::Result<void> add_textures(const SceneSurfaces& surfaces, PathData& data) {
  std::uint64_t texels = 0;
  for (const Texture& texture : surfaces.textures) texels += texture.texels.size();
  if (texels > std::numeric_limits<std::uint32_t>::max())
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "textures of " + std::to_string(texels) +
                                                                        " texels together, the limit is 4294967295"});
  data.texels.reserve(static_cast<std::size_t>(texels));
  for (const Texture& texture : surfaces.textures) {
    data.textures.push_back({static_cast<std::uint32_t>(data.texels.size()), texture.width, texture.height});
    data.texels.insert(data.texels.end(), texture.texels.begin(), texture.texels.end());
  }
  for (unsigned i = 0; i < 256; ++i) data.linear.push_back(linear_from_srgb(static_cast<float>(i) / 255.0f));
  return {};
}

void add_geometry(const GeometrySurface& surface, PathData& data) {
  PathGeometry geometry{data.triangles.size(), surface.coordinates.empty() ? kNoVertices : data.coordinates.size(),
                        surface.normals.empty() ? kNoVertices : data.normals.size(),
                        surface.shape_material.value_or(kInvalidId)};
  if (!surface.times.empty()) {
    geometry.times = static_cast<std::uint32_t>(surface.times.size());
    geometry.first_time = data.times.size();
    geometry.vertices = surface.normals.size() / surface.times.size();
    data.times.insert(data.times.end(), surface.times.begin(), surface.times.end());
  }
  data.geometries.push_back(geometry);
  for (const build::Triangle& t : surface.triangles) data.triangles.push_back({{t[0], t[1], t[2]}});
  data.triangle_material.insert(data.triangle_material.end(), surface.materials.begin(), surface.materials.end());
  for (const auto& c : surface.coordinates) data.coordinates.push_back({c[0], c[1]});
  for (const auto& n : surface.normals) data.normals.push_back(vec3(n));
}

/// The radiance that a material emits on average over its texture.
Vec3 mean_emission(const PathData& data, const PathMaterial& material) {
  if (!has_texture(material.emission_texture)) return material.emission;
  const PathTexture& texture = data.textures[material.emission_texture.texture];
  const std::size_t count = std::size_t{texture.width} * texture.height;
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t texel = data.texels[texture.first_texel + i];
    sum += glm::dvec3(data.linear[texel & 0xffu], data.linear[texel >> 8 & 0xffu], data.linear[texel >> 16 & 0xffu]);
  }
  return material.emission * Vec3(sum / static_cast<double>(std::max<std::size_t>(count, 1)));
}

/// The triangles that emit: those of each object, and where these are in the scene.
class LightFinder {
 public:
  LightFinder(const BufferView& scene, float time, PathData& data)
      : file_(scene), view_(make_scene_view(scene)), time_(time), data_(data) {
    for (const PathMaterial& material : data.materials) emission_.push_back(luminance(mean_emission(data, material)));
  }

  build::Result<void> run(const SceneSurfaces& surfaces) {
    if (std::none_of(emission_.begin(), emission_.end(), [](float e) { return e > 0.0f; })) return {};
    data_.triangle_light.assign(data_.triangles.size(), kInvalidId);
    for (std::size_t object = 0; object < surfaces.objects.size(); ++object) add_object(object, surfaces);
    for (const ObjectRecord& object : file_.objects)
      instances_.push_back(open_buffer(file_.object_file(object))->instances.size());
    shines_.assign(file_.objects.size(), 0);
    for (std::size_t i = 0; i < shines_.size(); ++i) shines_[i] = object_shines(i) ? 1 : 0;
    if (file_.has_instances()) {
      if (auto placed = collect_below(ObjectView(view_), file_.instances.size()); !placed) return placed;
    } else if (first_.size() == 2 && first_[1] > 0) {
      add_light_instance(0);
    }
    finish();
    return {};
  }

 private:
  /// What the lights of an object are, by the object's own file.
  void add_object(std::size_t object, const SceneSurfaces& surfaces) {
    if (first_.empty()) first_.push_back(0);
    const BufferView own = file_.has_instances() ? *open_buffer(file_.object_file(file_.objects[object])) : file_;
    for (std::size_t g = 0; g < surfaces.objects[object].size(); ++g) {
      const std::uint32_t number = data_.first_geometry[object] + static_cast<std::uint32_t>(g);
      const PathGeometry& geometry = data_.geometries[number];
      // Paths find the light of triangles that move by chance.
      const std::size_t count = geometry.times != 0 ? 0 : surfaces.objects[object][g].triangles.size();
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t triangle = static_cast<std::size_t>(geometry.first_triangle) + i;
        PathLight light{{}, number, static_cast<std::uint32_t>(i)};
        if (!(emission_[data_.triangle_material[triangle]] > 0.0f) || !read_corners(own, g, i, light)) continue;
        data_.triangle_light[triangle] = static_cast<std::uint32_t>(data_.lights.size() - first_.back());
        data_.lights.push_back(light);
      }
    }
    first_.push_back(data_.lights.size());
  }

  /// @return false for a triangle that no leaf holds.
  static bool read_corners(const BufferView& file, std::size_t geometry, std::size_t primitive, PathLight& light) {
    const auto at = static_cast<std::size_t>(file.geometries[geometry].first_primitive) + primitive;
    const std::uint32_t slot = file.primitive_map[at];
    if (slot == kInvalidId) return false;
    dispatch_layout(file.layout(), [&](auto layout) {
      using Layout = decltype(layout);
      const auto* leaves = reinterpret_cast<const typename Layout::Leaf*>(file.bytes.data() + file.leaves.offset);
      const auto& leaf = leaves[slot / 2];
      const unsigned which = slot % 2;
      unsigned vertex[3] = {corner_vertex(which, 0), corner_vertex(which, 1), corner_vertex(which, 2)};
      to_mesh_order(vertex, leaf.info.triangle_ids >> (8 * which));
      for (unsigned k = 0; k < 3; ++k)
        light.corner[k] = Vec3(Layout::coordinate(leaf, vertex[k], 0), Layout::coordinate(leaf, vertex[k], 1),
                               Layout::coordinate(leaf, vertex[k], 2));
    });
    return true;
  }

  /// Has triangles, not instances.
  bool is_own(std::size_t object) const { return instances_[object] == 0; }
  bool object_shines(std::size_t object) const {
    if (is_own(object)) return first_[object + 1] > first_[object];
    const ObjectView group(view_, file_.objects[object]);
    for (std::size_t i = 0; i < instances_[object]; ++i)
      if (shines_[group.instances[i].object] != 0) return true;
    return false;
  }
  build::Result<void> collect_below(const ObjectView& group, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t object = group.instances[i].object;
      if (shines_[object] == 0) continue;
      path_.push_back(static_cast<std::uint32_t>(i));
      if (is_own(object)) {
        if (lights_ + (first_[object + 1] - first_[object]) > kMostLights)
          return tl::unexpected(build::Error{build::ErrorCode::kTooLarge,
                                             "more than " + std::to_string(kMostLights) + " triangles that emit"});
        add_light_instance(object);
      } else if (auto placed = collect_below(ObjectView(view_, file_.objects[object]), instances_[object]); !placed) {
        return placed;
      }
      path_.pop_back();
    }
    return {};
  }

  void add_light_instance(std::size_t object) {
    data_.light_instances.push_back({static_cast<std::uint32_t>(lights_), static_cast<std::uint32_t>(first_[object]),
                                     static_cast<std::uint32_t>(data_.light_paths.size()),
                                     static_cast<std::uint32_t>(path_.size())});
    data_.light_paths.insert(data_.light_paths.end(), path_.begin(), path_.end());
    lights_ += first_[object + 1] - first_[object];
    InstancePath<kTraceLevels> path;
    for (const std::uint32_t instance : path_) path.instance[path.depth++] = instance;
    const InstanceTransform where(view_, path, time_);
    for (std::size_t i = first_[object]; i < first_[object + 1]; ++i) {
      const PathLight& light = data_.lights[i];
      glm::dvec3 corner[3];
      for (unsigned k = 0; k < 3; ++k) corner[k] = glm::dvec3(where.point_to_scene(light.corner[k]));
      const double area = 0.5 * glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
      const auto material = data_.triangle_material[static_cast<std::size_t>(
          data_.geometries[light.geometry].first_triangle + light.primitive)];
      weights_.push_back(area * static_cast<double>(emission_[material]));
    }
  }

  void finish() {
    double total = 0.0, sum = 0.0;
    for (const double weight : weights_) total += weight;
    if (!(total > 0.0 && std::isfinite(total))) {
      data_.light_instances.clear();
      return;
    }
    for (const double weight : weights_) {
      data_.light_sums.push_back(static_cast<float>(sum / total));
      sum += weight;
    }
    data_.light_sums.push_back(1.0f);
  }

  const BufferView& file_;
  SceneView view_;
  float time_;
  PathData& data_;
  std::vector<float> emission_;         ///< Of materials: luminance.
  std::vector<std::size_t> first_;      ///< Index of each object's first light, then the total number.
  std::vector<unsigned char> shines_;   ///< Per object of a scene: whether it emits, or an object below it does.
  std::vector<std::size_t> instances_;  ///< Of each object of a scene.
  std::vector<std::uint32_t> path_;
  std::vector<double> weights_;
  std::uint64_t lights_ = 0;
};

}  // namespace

build::Result<PathData> make_path_data(const BufferView& scene, const SceneSurfaces* surfaces, PathSky sky,
                                       std::vector<Vec3> backdrop, float middle) try {
  PathData data;
  data.sky = std::move(sky.radiance);
  data.sky_rows = std::move(sky.rows);
  data.sky_columns = std::move(sky.columns);
  data.backdrop = std::move(backdrop);
  if (surfaces == nullptr) {
    data.materials.push_back(clay());
    return data;
  }
  if (auto added = add_textures(*surfaces, data); !added) return tl::unexpected(std::move(added.error()));
  add_materials(*surfaces, data);
  for (const auto& object : surfaces->objects) {
    data.first_geometry.push_back(static_cast<std::uint32_t>(data.geometries.size()));
    for (const GeometrySurface& geometry : object) add_geometry(geometry, data);
  }
  if (auto found = LightFinder(scene, middle, data).run(*surfaces); !found)
    return tl::unexpected(std::move(found.error()));
  return data;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(build::out_of_memory({"for materials and lights"}, failure));
}

PathArrays<PathView> views(const PathData& data) {
  PathArrays<PathView> result;
  PathData::for_each(data, result, [](const auto& from, auto& to) { to = {from.data(), from.size()}; });
  return result;
}

bool has_alpha_cutout(const PathData& data) {
  return std::any_of(data.materials.begin(), data.materials.end(),
                     [](const PathMaterial& m) { return m.alpha_cutoff > 0.0f; });
}

}  // namespace hiprt::tools
