#include <tools/parts/build_parts.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/parts/part_boxes.h>
#include <tools/parts/part_data.h>
#include <tools/parts/split_scene.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

namespace hiprt::tools {
namespace {

/// Memory of an instance: its record, and its leaf and nodes in the tree.
constexpr std::uint64_t kInstanceBytes = 192;

/// A box in double that may be empty.
struct Bounds {
  std::array<double, 3> min{kInfinity, kInfinity, kInfinity}, max{-kInfinity, -kInfinity, -kInfinity};

  bool empty() const { return min[0] > max[0]; }
  double center(unsigned axis) const { return empty() ? 0.0 : 0.5 * min[axis] + 0.5 * max[axis]; }
  void add(const std::array<double, 3>& point) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      min[axis] = std::min(min[axis], point[axis]);
      max[axis] = std::max(max[axis], point[axis]);
    }
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
};

/// Where instances of the scene are, what they need, and which of them emit light.
class SceneMap {
 public:
  SceneMap(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces)
      : scene_(scene), files_(files), bounds_(files.size()) {
    const std::size_t objects = files.size() + scene.groups.size() - 1;
    bounds_.resize(objects);
    reached_.resize(objects);
    shines_.resize(objects);
    for (std::size_t i = 0; i < files.size(); ++i) {
      bounds_[i] = bounds_of(files[i]);
      reached_[i] = {static_cast<std::uint32_t>(i)};
      shines_[i] = surfaces != nullptr && shines(*surfaces, surfaces->objects[i]) ? 1 : 0;
    }
    // Groups have objects of lower numbers only.
    for (std::size_t g = 0; g + 1 < scene.groups.size(); ++g) add_group(files.size() + g, scene.groups[g]);
  }

  bool shines(const build::Instance& instance) const { return shines_[instance.object] != 0; }
  /// All objects that an instance leads to: files and groups.
  const std::vector<std::uint32_t>& reached(const build::Instance& instance) const { return reached_[instance.object]; }

  SplitInput split_input(std::span<const std::uint32_t> instances) const {
    SplitInput input;
    input.instance_bytes = kInstanceBytes;
    input.needs = reached_;
    for (const build::Buffer& file : files_) input.file_bytes.push_back(std::as_const(file).bytes().size());
    for (std::size_t g = 0; g + 1 < scene_.groups.size(); ++g)
      input.file_bytes.push_back(scene_.groups[g].instances.size() * kInstanceBytes);
    for (const std::uint32_t i : instances) {
      const build::Instance& instance = scene_.groups.back().instances[i];
      const Bounds box = placed(instance);
      input.instances.push_back({{box.center(0), box.center(1), box.center(2)}, instance.object});
    }
    return input;
  }

 private:
  static Bounds bounds_of(const build::Buffer& file) {
    Bounds bounds;
    const auto view = open_buffer(std::as_const(file).bytes());
    if (!view || view->header->root == kInvalidRef) return bounds;
    const Box& box = view->header->bounds;
    bounds.add({double{box.min[0]}, double{box.min[1]}, double{box.min[2]}});
    bounds.add({double{box.max[0]}, double{box.max[1]}, double{box.max[2]}});
    return bounds;
  }

  static bool shines(const SceneSurfaces& surfaces, const std::vector<GeometrySurface>& geometries) {
    const auto emits = [&](std::uint32_t material) {
      const auto& emission = surfaces.materials[material].emission;
      return std::any_of(emission.begin(), emission.end(), [](float channel) { return channel > 0.0f; });
    };
    return std::any_of(geometries.begin(), geometries.end(), [&](const GeometrySurface& geometry) {
      return std::any_of(geometry.materials.begin(), geometry.materials.end(), emits) ||
             (geometry.shape_material && emits(*geometry.shape_material));
    });
  }

  void add_group(std::size_t object, const SceneGroup& group) {
    std::set<std::uint32_t> reached{static_cast<std::uint32_t>(object)};
    for (const build::Instance& instance : group.instances) {
      const Bounds box = placed(instance);
      if (!box.empty()) {
        bounds_[object].add(box.min);
        bounds_[object].add(box.max);
      }
      if (!reached.contains(instance.object))
        reached.insert(reached_[instance.object].begin(), reached_[instance.object].end());
      shines_[object] |= shines_[instance.object];
    }
    reached_[object].assign(reached.begin(), reached.end());
  }

  /// About where an instance is: of a moving one the middle of its translations.
  Bounds placed(const build::Instance& instance) const {
    const Bounds& own = bounds_[instance.object];
    Bounds result;
    if (own.empty()) return result;
    if (instance.motion != nullptr) {
      const auto add = [&](double x, double y, double z) {
        result.add({own.center(0) + x, own.center(1) + y, own.center(2) + z});
      };
      for (const build::MotionKey& key : instance.motion->keys)
        add(double{key.translation[0]}, double{key.translation[1]}, double{key.translation[2]});
      for (const build::MatrixKey& key : instance.motion->matrices)
        add(double{key.to_scene.row[0][3]}, double{key.to_scene.row[1][3]}, double{key.to_scene.row[2][3]});
      return result;
    }
    for (unsigned corner = 0; corner < 8; ++corner) {
      std::array<double, 3> point{};
      for (unsigned row = 0; row < 3; ++row) {
        point[row] = double{instance.to_scene.row[row][3]};
        for (unsigned k = 0; k < 3; ++k)
          point[row] += double{instance.to_scene.row[row][k]} * ((corner >> k & 1u) != 0 ? own.max[k] : own.min[k]);
      }
      result.add(point);
    }
    return result;
  }

  const SceneDescription& scene_;
  std::span<const build::Buffer> files_;
  std::vector<Bounds> bounds_;                       ///< Of each object, in its own space.
  std::vector<std::vector<std::uint32_t>> reached_;  ///< By each object: it and all below it, ascending.
  std::vector<char> shines_;
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

class PartsBuilder {
 public:
  PartsBuilder(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces,
               const PartsOptions& options, const BuildRequest& request, const ProgressSink& progress)
      : scene_(scene), files_(files), surfaces_(surfaces), options_(options), request_(request), progress_(progress) {}

  build::Result<PartManifest> run() {
    const auto& instances = scene_.groups.back().instances;
    if (instances.size() >= kInvalidId)
      return fail(build::ErrorCode::kTooLarge,
                  scene_.path + ": " + std::to_string(instances.size()) + " instances; parts number at most 2^32 - 1");
    const SceneMap map(scene_, files_, surfaces_);
    std::vector<std::uint32_t> shared, own;
    for (std::uint32_t i = 0; i < instances.size(); ++i) (map.shines(instances[i]) ? shared : own).push_back(i);
    if (own.size() < options_.parts)
      return invalid_input(
          scene_.path + ": " + std::to_string(options_.parts) + " parts need as many instances, and " +
          std::to_string(own.size()) + " can be distributed: those of the scene itself without light" +
          (scene_.groups.size() > 1 ? "; groups stay whole, --levels 1 replaces them by their instances" : ""));
    manifest_.path = options_.output;
    manifest_.instances = instances.size();
    manifest_.materials = surfaces_ != nullptr;
    const auto parts = split_scene(map.split_input(own), options_.parts);
    const std::size_t all = parts.size() + (shared.empty() ? 0 : 1);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      std::vector<std::uint32_t> selected;
      for (const std::uint32_t k : parts[i]) selected.push_back(own[k]);
      auto part = build_one(map, selected, std::to_string(i), i, all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.parts.push_back(std::move(*part));
    }
    if (!shared.empty()) {
      auto part = build_one(map, shared, "shared", parts.size(), all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.shared = std::move(*part);
    }
    const std::string text = to_json(manifest_);
    if (auto written = build::write_file(options_.output, std::as_bytes(std::span(text))); !written)
      return tl::unexpected(std::move(written.error()));
    return std::move(manifest_);
  }

 private:
  build::Result<ScenePart> build_one(const SceneMap& map, std::vector<std::uint32_t> instances, const std::string& word,
                                     std::size_t number, std::size_t all) {
    SceneSelection selection{std::move(instances), {}};
    std::set<std::uint32_t> objects;
    for (const std::uint32_t i : selection.instances) {
      const build::Instance& instance = scene_.groups.back().instances[i];
      if (objects.contains(instance.object)) continue;
      const auto& reached = map.reached(instance);
      objects.insert(reached.begin(), reached.end());
    }
    selection.objects.assign(objects.begin(), objects.end());
    const auto step = [&](const char*, double done) {
      progress_("parts", (static_cast<double>(number) + done) / static_cast<double>(all));
    };
    const auto bvh = build_selection(scene_, files_, selection, options_.on_gpu, request_, step);
    if (!bvh) return tl::unexpected(bvh.error());
    const auto bytes = std::as_const(bvh->buffer).bytes();
    const auto view = open_buffer(bytes);
    if (!view) return fail(build::ErrorCode::kBackend, "the part that was built: " + to_string(view.error()));
    const FileHeader& header = *view->header;
    const bool empty = header.root == kInvalidRef;
    ScenePart part{{},
                   {},
                   selection.instances.size(),
                   empty ? Box{} : header.bounds,
                   header.condition,
                   header.reach,
                   boxes_near_root(*view, kMostPartBoxes)};
    manifest_.levels = std::max(manifest_.levels, std::uint32_t{header.levels});
    if (auto written = write(word + ".bvh", bytes, part.bvh); !written) return tl::unexpected(written.error());
    if (auto written = write(word + ".data", encode(data_of(selection)), part.data); !written)
      return tl::unexpected(written.error());
    return part;
  }

  PartData data_of(const SceneSelection& selection) const {
    PartData data{selection.instances};
    if (surfaces_ == nullptr) return data;
    std::vector<std::uint32_t> own;
    for (const std::uint32_t object : selection.objects)
      if (object < files_.size()) own.push_back(object);
    data.surfaces = SurfaceSelection(*surfaces_, own).take();
    return data;
  }

  build::Result<void> write(const std::string& ending, std::span<const std::byte> bytes, PartFile& file) const {
    const std::filesystem::path path = std::filesystem::path(options_.output).replace_extension(ending);
    file = {path.filename().string(), bytes.size(), to_text(digest_of(bytes))};
    if (interrupted()) return fail(build::ErrorCode::kCancelled, "cancelled");
    return build::write_file(path, bytes);
  }

  const SceneDescription& scene_;
  std::span<const build::Buffer> files_;
  const SceneSurfaces* surfaces_;
  const PartsOptions& options_;
  const BuildRequest& request_;
  const ProgressSink& progress_;
  PartManifest manifest_;
};

}  // namespace

bool is_plain_clay(const SceneSurfaces& surfaces) {
  if (!surfaces.textures.empty() || surfaces.materials.size() > 1) return false;
  // surface_load.cpp makes this material for files without materials.
  for (const Material& material : surfaces.materials)
    if (material.name != "clay" || material.metallic != 0.0f || material.alpha_cutoff != 0.0f) return false;
  return std::all_of(surfaces.objects.begin(), surfaces.objects.end(), [](const auto& object) {
    return std::all_of(object.begin(), object.end(), [](const GeometrySurface& geometry) {
      return geometry.coordinates.empty() && geometry.normals.empty();
    });
  });
}

build::Result<PartManifest> build_parts(const SceneDescription& scene, std::span<const build::Buffer> files,
                                        const SceneSurfaces* surfaces, const PartsOptions& options,
                                        const BuildRequest& request, const ProgressSink& progress) {
  return PartsBuilder(scene, files, surfaces, options, request, progress).run();
}

}  // namespace hiprt::tools
