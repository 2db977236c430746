#include <tools/parts/build_parts.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/parts/part_boxes.h>
#include <tools/parts/part_data.h>
#include <tools/parts/split_scene.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace hiprt::tools {
namespace {

/// Memory of an instance: its record, and its leaf and nodes in the tree.
constexpr std::uint64_t kInstanceBytes = 192;

/// Groups are opened while they have more than this fraction of a part's memory, and until there are so many pieces.
constexpr std::uint64_t kPiecesOfPart = 8;
constexpr std::size_t kMostPiecesOfPart = 4096;

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
  void add(const Bounds& other) {
    if (other.empty()) return;
    add(other.min);
    add(other.max);
  }
  Bounds transformed(const Transform& transform) const {
    Bounds result;
    for (unsigned corner = 0; !empty() && corner < 8; ++corner) {
      std::array<double, 3> point{};
      for (unsigned row = 0; row < 3; ++row) {
        point[row] = transform.m[row][3];
        for (unsigned k = 0; k < 3; ++k)
          point[row] += transform.m[row][k] * ((corner >> k & 1u) != 0 ? max[k] : min[k]);
      }
      result.add(point);
    }
    return result;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
};

/// About where an instance is. Of a moving one: where its first key puts it, without rotation.
Transform transform_of(const build::Instance& instance) {
  if (instance.motion == nullptr) return to_double(instance.to_scene);
  if (!instance.motion->matrices.empty()) return to_double(instance.motion->matrices.front().to_scene);
  Transform result;
  if (instance.motion->keys.empty()) return result;
  const build::MotionKey& key = instance.motion->keys.front();
  for (unsigned row = 0; row < 3; ++row) {
    result.m[row][row] = double{key.scale[row]};
    result.m[row][3] = double{key.translation[row]};
  }
  return result;
}

/// What is distributed: an instance of the scene, or one below opened groups.
struct Piece {
  std::vector<std::uint32_t> path;  ///< From the scene on.
  std::uint32_t object;
  Transform to_scene;

  friend bool operator<(const Piece& a, const Piece& b) { return a.path < b.path; }
};

/// The objects of a scene: where they are, what they need, and which of them emit light.
class SceneMap {
 public:
  SceneMap(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces)
      : scene_(scene), files_(files.size()) {
    const std::size_t objects = files.size() + scene.groups.size() - 1;
    bounds_.resize(objects);
    reached_.resize(objects);
    shines_.resize(objects);
    for (std::size_t i = 0; i < files.size(); ++i) {
      bounds_[i] = bounds_of(files[i]);
      reached_[i] = {static_cast<std::uint32_t>(i)};
      bytes_.push_back(std::as_const(files[i]).bytes().size());
      shines_[i] = surfaces != nullptr && emits(*surfaces, surfaces->objects[i]) ? 1 : 0;
    }
    // Groups have objects of lower numbers only.
    for (std::size_t g = 0; g + 1 < scene.groups.size(); ++g) add_group(files.size() + g, scene.groups[g]);
  }

  bool shines(std::uint32_t object) const { return shines_[object] != 0; }
  bool is_group(std::uint32_t object) const { return object >= files_; }
  /// Index in SceneDescription::groups.
  std::size_t group_number(std::uint32_t object) const { return object - files_; }
  const SceneGroup& group(std::uint32_t object) const { return scene_.groups[group_number(object)]; }
  /// All objects that an object needs, and itself: files and groups.
  const std::vector<std::uint32_t>& reached(std::uint32_t object) const { return reached_[object]; }
  std::uint64_t bytes(std::uint32_t object) const {
    std::uint64_t sum = kInstanceBytes;
    for (const std::uint32_t needed : reached_[object]) sum += bytes_[needed];
    return sum;
  }
  std::uint64_t bytes_of_all() const { return std::accumulate(bytes_.begin(), bytes_.end(), std::uint64_t{0}); }

  SplitInput split_input(std::span<const Piece> pieces) const {
    SplitInput input{{}, reached_, bytes_, kInstanceBytes};
    for (const Piece& piece : pieces) {
      const Bounds box = bounds_[piece.object].transformed(piece.to_scene);
      input.instances.push_back({{box.center(0), box.center(1), box.center(2)}, piece.object});
    }
    return input;
  }

 private:
  static Bounds bounds_of(const build::Buffer& file) {
    Bounds bounds;
    const auto view = open_buffer(std::as_const(file).bytes());
    if (!view || view->header->root == kInvalidRef) return bounds;
    const Box& box = view->header->bounds;
    for (const auto& corner : {box.min, box.max})
      bounds.add(std::array{double{corner[0]}, double{corner[1]}, double{corner[2]}});
    return bounds;
  }

  static bool emits(const SceneSurfaces& surfaces, const std::vector<GeometrySurface>& geometries) {
    const auto is_light = [&](std::uint32_t material) {
      const auto& emission = surfaces.materials[material].emission;
      return std::any_of(emission.begin(), emission.end(), [](float channel) { return channel > 0.0f; });
    };
    return std::any_of(geometries.begin(), geometries.end(), [&](const GeometrySurface& geometry) {
      return std::any_of(geometry.materials.begin(), geometry.materials.end(), is_light) ||
             (geometry.shape_material && is_light(*geometry.shape_material));
    });
  }

  void add_group(std::size_t object, const SceneGroup& group) {
    std::set<std::uint32_t> reached{static_cast<std::uint32_t>(object)};
    for (const build::Instance& instance : group.instances) {
      bounds_[object].add(bounds_[instance.object].transformed(transform_of(instance)));
      if (!reached.contains(instance.object))
        reached.insert(reached_[instance.object].begin(), reached_[instance.object].end());
      if (shines_[instance.object] != 0) shines_[object] = 1;
    }
    reached_[object].assign(reached.begin(), reached.end());
    bytes_.push_back(group.instances.size() * kInstanceBytes);
  }

  const SceneDescription& scene_;
  std::size_t files_;
  std::vector<Bounds> bounds_;                       ///< Of each object, in its own space.
  std::vector<std::vector<std::uint32_t>> reached_;  ///< By each object, ascending.
  std::vector<std::uint64_t> bytes_;                 ///< Of each object without those below it.
  std::vector<char> shines_;
};

/// The pieces of a scene: its instances, and those of groups that are too large to stay whole or that emit.
class Pieces {
 public:
  Pieces(const SceneDescription& scene, const SceneMap& map, std::size_t parts)
      : map_(map), most_(std::max(kMostPiecesOfPart * parts, scene.groups.back().instances.size())) {
    const std::uint64_t large = map.bytes_of_all() / (kPiecesOfPart * parts);
    add_all({{}, 0, {}}, scene.groups.back());
    // The largest first. Pieces that shine are opened down to the objects that do.
    while (!closed_.empty()) {
      std::pop_heap(closed_.begin(), closed_.end(), opens_later);
      const Piece piece = std::move(closed_.back().piece);
      const bool shines = map.shines(piece.object), is_large = closed_.back().bytes > large;
      closed_.pop_back();
      const std::size_t inside = map.group(piece.object).instances.size();
      if (shines || (is_large && own.size() + closed_.size() + inside <= most_))
        add_all(piece, map.group(piece.object));
      else
        own.push_back(piece);
    }
    std::sort(own.begin(), own.end());
    std::sort(shared.begin(), shared.end());
  }

  std::vector<Piece> own;     ///< Ascending.
  std::vector<Piece> shared;  ///< Objects that emit light. Ascending.

 private:
  struct Closed {
    std::uint64_t bytes;
    Piece piece;
  };

  void add_all(const Piece& outer, const SceneGroup& group) {
    for (std::uint32_t i = 0; i < group.instances.size(); ++i) {
      const build::Instance& instance = group.instances[i];
      Piece piece{outer.path, instance.object, outer.to_scene * transform_of(instance)};
      piece.path.push_back(i);
      if (!map_.is_group(piece.object)) {
        (map_.shines(piece.object) ? shared : own).push_back(std::move(piece));
        continue;
      }
      closed_.push_back({map_.bytes(piece.object), std::move(piece)});
      std::push_heap(closed_.begin(), closed_.end(), opens_later);
    }
  }
  static bool opens_later(const Closed& a, const Closed& b) {
    return a.bytes != b.bytes ? a.bytes < b.bytes : b.piece < a.piece;
  }

  const SceneMap& map_;
  std::size_t most_;
  std::vector<Closed> closed_;  ///< A heap.
};

/// Makes the groups of a part: those of the scene with the instances that lead to its pieces.
class Selector {
 public:
  Selector(const SceneDescription& scene, const SceneMap& map, std::span<const Piece> pieces)
      : scene_(scene), map_(map) {
    std::set<std::uint32_t> files;
    for (const Piece& piece : pieces)
      for (const std::uint32_t object : map.reached(piece.object))
        if (!map.is_group(object)) files.insert(object);
    selection_.files.assign(files.begin(), files.end());
    for (std::uint32_t i = 0; i < selection_.files.size(); ++i) whole_[selection_.files[i]] = i;
    add(part_of(scene.groups.size() - 1, pieces, 0));
  }

  SceneSelection take() { return std::move(selection_); }

 private:
  /// The instances of a group that lead to pieces. @param depth of the group on their paths.
  SceneSelection::Group part_of(std::size_t original, std::span<const Piece> pieces, std::size_t depth) {
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

class PartsBuilder {
 public:
  PartsBuilder(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces,
               const PartsOptions& options, const BuildRequest& request, const ProgressSink& progress)
      : scene_(scene), files_(files), surfaces_(surfaces), options_(options), request_(request), progress_(progress) {}

  build::Result<PartManifest> run() {
    const SceneMap map(scene_, files_, surfaces_);
    const Pieces pieces(scene_, map, options_.parts);
    if (pieces.own.size() < options_.parts)
      return invalid_input(scene_.path + ": " + std::to_string(options_.parts) + " parts need as many instances, and " +
                           std::to_string(pieces.own.size()) + " can be distributed: those without light");
    manifest_.path = options_.output;
    manifest_.instances = pieces.own.size() + pieces.shared.size();
    manifest_.materials = surfaces_ != nullptr;
    const auto parts = split_scene(map.split_input(pieces.own), options_.parts);
    const std::size_t all = parts.size() + (pieces.shared.empty() ? 0 : 1);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      std::vector<Piece> selected;
      for (const std::uint32_t k : parts[i]) selected.push_back(pieces.own[k]);
      auto part = build_one(map, selected, std::to_string(i), i, all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.parts.push_back(std::move(*part));
    }
    if (!pieces.shared.empty()) {
      auto part = build_one(map, pieces.shared, "shared", parts.size(), all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.shared = std::move(*part);
    }
    const std::string text = to_json(manifest_);
    if (auto written = build::write_file(options_.output, std::as_bytes(std::span(text))); !written)
      return tl::unexpected(std::move(written.error()));
    return std::move(manifest_);
  }

 private:
  build::Result<ScenePart> build_one(const SceneMap& map, std::span<const Piece> pieces, const std::string& word,
                                     std::size_t number, std::size_t all) {
    const SceneSelection selection = Selector(scene_, map, pieces).take();
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
                   pieces.size(),
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
    PartData data;
    for (const SceneSelection::Group& group : selection.groups) {
      const bool all = group.instances.size() == scene_.groups[group.original].instances.size();
      data.groups.push_back(all ? std::vector<std::uint32_t>{} : group.instances);
    }
    if (surfaces_ != nullptr) data.surfaces = SurfaceSelection(*surfaces_, selection.files).take();
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
