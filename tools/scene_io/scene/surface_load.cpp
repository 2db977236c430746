#include <tools/scene_io/scene/surface_load.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/scene/scene_assembly.h>
#include <tools/scene_io/scene/scene_bake.h>
#include <tools/scene_io/scene/scene_file.h>
#include <tools/scene_io/scene/scene_flatten.h>
#include <tools/scene_io/scene/scene_motion.h>
#include <tools/scene_io/shapes/shape_import.h>
#include <tools/scene_io/surface/material_library.h>

#include <hiprt_build/format/view.h>

#include <iterator>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

/// A geometry, and its origin for messages.
struct NamedSurface {
  std::string name;
  GeometrySurface surface;
};

/// Everything that was read.
struct Reading {
  std::vector<std::string> warnings;
  MaterialLibrary library;
  std::optional<std::uint32_t> clay;               ///< Its number in the library.
  std::vector<std::vector<NamedSurface>> objects;  ///< Without groups.
};

std::uint32_t clay_of(Reading& reading) {
  if (!reading.clay) {
    reading.clay = static_cast<std::uint32_t>(reading.library.materials.size());
    Material& clay = reading.library.materials.emplace_back();
    clay.name = "clay";
    clay.base_color = {0.80f, 0.775f, 0.745f};
    clay.metallic = 0.0f;
  }
  return *reading.clay;
}

/// @pre kind kMovingTriangles
GeometrySurface surface_of_triangles(const ShapeSet& shapes, Reading& reading) {
  GeometrySurface result;
  for (std::size_t i = 0; i < shapes.segments.size(); i += 3)
    result.triangles.push_back({shapes.segments[i], shapes.segments[i + 1], shapes.segments[i + 2]});
  for (std::size_t k = 0; k < shapes.keys; ++k)
    result.times.push_back(shapes.points[k * (shapes.points.size() / shapes.keys)].radius);
  if (shapes.surface) {
    result.materials = shapes.surface->materials;
    result.coordinates = shapes.surface->coordinates;
    result.normals = shapes.surface->normals;
  } else {
    result.materials.assign(result.triangles.size(), clay_of(reading));
  }
  return result;
}

NamedSurface surface_of(const ShapeSet& shapes, Reading& reading) {
  if (shapes.kind == ShapeKind::kMovingTriangles) return {shapes.name, surface_of_triangles(shapes, reading)};
  NamedSurface result{shapes.name, {}};
  result.surface.shapes = shapes.size();
  result.surface.shape_material = clay_of(reading);
  return result;
}

/// Moves the mesh's parts into the result; @p mesh keeps its positions.
GeometrySurface surface_of(Mesh& mesh, Reading& reading) {
  GeometrySurface result;
  result.triangles = std::move(mesh.triangles);
  if (mesh.surface) {
    result.materials = std::move(mesh.surface->materials);
    result.coordinates = std::move(mesh.surface->coordinates);
    result.normals = std::move(mesh.surface->normals);
    return result;
  }
  result.materials.assign(result.triangles.size(), clay_of(reading));
  return result;
}

/// What the surfaces must fit: a BVH file, or the files of a scene's objects.
class BuiltScene {
 public:
  explicit BuiltScene(const BufferView& file) : file_(&file) {
    // Merged levels leave fewer groups than the inputs have, so groups do not count.
    for (const ObjectRecord& object : file.objects) {
      const auto view = open_buffer(file.object_file(object));
      if (!view || !view->has_instances()) ++objects_;
    }
    groups_ = file.objects.size() - objects_;
  }
  explicit BuiltScene(std::span<const build::Buffer> files) : files_(files), objects_(files.size()) {}

  bool has_instances() const { return file_ == nullptr || file_->has_instances(); }
  /// Objects with geometries, and behind them groups of instances.
  std::size_t objects() const { return objects_; }
  std::size_t groups() const { return groups_; }
  tl::expected<BufferView, FormatIssue> object(std::size_t i) const {
    return open_buffer(file_ != nullptr ? file_->object_file(file_->objects[i]) : files_[i].bytes());
  }
  /// @pre not has_instances()
  const BufferView& file() const { return *file_; }

  /// The times of the first triangles that move; empty if none do. bvhbuild gives all of them the same times.
  std::vector<float> times() const {
    for (std::size_t i = 0; has_instances() && i < objects_; ++i)
      if (const auto view = object(i))
        for (const ShapeRecord& shape : view->shapes)
          if (shape.kind == ShapeKind::kMovingTriangles) return times_of(*view, shape);
    return {};
  }

 private:
  static std::vector<float> times_of(const BufferView& view, const ShapeRecord& shape) {
    std::vector<float> result;
    const auto* points = reinterpret_cast<const ShapePoint*>(view.bytes.data() + shape.points);
    for (std::size_t k = 0; k < shape.keys; ++k) result.push_back(points[k * (shape.point_count / shape.keys)].radius);
    return result;
  }

  const BufferView* file_ = nullptr;
  std::span<const build::Buffer> files_{};
  std::size_t objects_ = 0, groups_ = 0;
};

class SurfaceReader {
 public:
  SurfaceReader(std::span<const std::string> inputs, const BuiltScene& bvh, const std::string& output)
      : inputs_(inputs), bvh_(bvh), output_(output) {}

  build::Result<Reading> read() {
    if (inputs_.empty()) return invalid_input("0 files, those that the BVH was built of expected");
    for (const std::string& input : inputs_)
      if (is_scene_file(input) && inputs_.size() != 1)
        return invalid_input(input + " is a scene, which has to be the only file; there are " +
                             std::to_string(inputs_.size()));
    if (is_scene_file(inputs_[0])) return bvh_.has_instances() ? read_objects() : read_flattened();
    if (bvh_.has_instances()) return read_objects();
    auto result = read_files();
    if (result || result.error().code != build::ErrorCode::kInvalidInput) return result;
    // With --instances --flatten there is a geometry per use of a mesh.
    auto flattened = read_flattened();
    return flattened ? std::move(flattened) : std::move(result);
  }

 private:
  static void add_warnings(Reading& reading, const std::string& input, const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) reading.warnings.push_back(input + ": " + warning);
  }

  build::Result<void> check_files(const std::vector<std::string>& files) const {
    if (output_.empty()) return {};
    return check_output(output_, files);
  }

  build::Result<Mesh> read_mesh(const std::string& input, Reading& reading) const {
    if (auto checked = check_files({input}); !checked) return tl::unexpected(checked.error());
    auto mesh = load_mesh(input, &reading.library);
    if (!mesh) return mesh;
    add_warnings(reading, input, mesh->warnings);
    if (auto checked = check_files(mesh->files); !checked) return tl::unexpected(checked.error());
    return mesh;
  }

  build::Result<ShapeSet> read_shapes(const std::string& input) const {
    if (auto checked = check_files({input}); !checked) return tl::unexpected(checked.error());
    return load_shapes(input);
  }

  /// Every file becomes a geometry: the meshes first.
  build::Result<Reading> read_files() const {
    Reading result;
    result.objects.emplace_back();
    std::vector<NamedSurface> shapes;
    for (const std::string& input : inputs_) {
      if (is_shape_file(input)) {
        const auto set = read_shapes(input);
        if (!set) return tl::unexpected(set.error());
        shapes.push_back(surface_of(*set, result));
        continue;
      }
      auto mesh = read_mesh(input, result);
      if (!mesh) return tl::unexpected(mesh.error());
      result.objects[0].push_back({mesh->name, surface_of(*mesh, result)});
    }
    std::move(shapes.begin(), shapes.end(), std::back_inserter(result.objects[0]));
    return checked(std::move(result));
  }

  /// Every use of an object's mesh in the scene becomes a geometry.
  build::Result<Reading> read_flattened() const {
    Reading result;
    const auto scene = read_scene(result);
    if (!scene) return tl::unexpected(scene.error());
    auto geometries = flatten_scene(*scene);
    if (!geometries) return tl::unexpected(geometries.error());
    result.objects.emplace_back();
    for (FlatGeometry& geometry : *geometries) {
      Mesh mesh = to_mesh(*scene, std::move(geometry));
      result.objects[0].push_back({mesh.name, surface_of(mesh, result)});
    }
    return checked(std::move(result));
  }

  /// The scene's objects and groups.
  build::Result<Reading> read_objects() const {
    Reading result;
    auto scene = read_scene(result);
    if (!scene) return tl::unexpected(scene.error());
    // As bvhbuild does.
    repair_motions(*scene);
    if (auto baked = bake_singular(*scene); !baked) return tl::unexpected(baked.error());
    std::vector<GeometrySurface> surfaces;
    for (Mesh& mesh : scene->meshes) surfaces.push_back(surface_of(mesh, result));
    for (const SceneObject& object : scene->objects) {
      auto& geometries = result.objects.emplace_back();
      for (const std::size_t mesh : object.meshes) geometries.push_back({scene->meshes[mesh].name, surfaces[mesh]});
      for (const std::size_t set : object.shapes) geometries.push_back(surface_of(scene->shapes[set], result));
    }
    return checked(std::move(result));
  }

  build::Result<SceneDescription> read_scene(Reading& reading) const {
    if (!is_scene_file(inputs_[0])) return read_assemblies(reading);
    if (auto checked = check_files({inputs_[0]}); !checked) return tl::unexpected(checked.error());
    auto scene = read_scene_file(inputs_[0]);
    if (!scene) return scene;
    for (ShapeSet& set : scene->shapes) {
      if (set.path.empty()) continue;
      auto shapes = read_shapes(set.path);
      if (!shapes) return tl::unexpected(shapes.error());
      set = std::move(*shapes);
    }
    for (const std::string& file : scene->files) {
      auto mesh = read_mesh(file, reading);
      if (!mesh) return tl::unexpected(mesh.error());
      scene->meshes.push_back(std::move(*mesh));
    }
    return scene;
  }

  build::Result<SceneDescription> read_assemblies(Reading& reading) const {
    SceneDescription scene;
    scene.groups.push_back({"instances", {}});
    const std::vector<float> times = bvh_.times();
    for (const std::string& input : inputs_) {
      if (is_shape_file(input)) {
        auto shapes = read_shapes(input);
        if (!shapes) return tl::unexpected(shapes.error());
        add_shape_object(scene, std::move(*shapes));
        continue;
      }
      if (auto checked = check_files({input}); !checked) return tl::unexpected(checked.error());
      auto assembly = load_assembly(input, times, &reading.library);
      if (!assembly) return tl::unexpected(assembly.error());
      add_warnings(reading, input, assembly->warnings);
      if (auto checked = check_files(assembly->files); !checked) return tl::unexpected(checked.error());
      add_assembly(scene, std::move(*assembly), times);
    }
    return scene;
  }

  /// Checks that objects, geometries and primitives have the same numbers as in the BVH.
  build::Result<Reading> checked(Reading reading) const {
    if (!bvh_.has_instances()) {
      if (auto fits = check_geometries("", reading.objects[0], bvh_.file()); !fits) return tl::unexpected(fits.error());
      return reading;
    }
    const std::size_t objects = reading.objects.size();
    if (objects != bvh_.objects())
      return invalid_input(inputs_[0] + (inputs_.size() > 1 ? " and the other files make " : " makes ") +
                           std::to_string(objects) + " objects, the BVH has " + std::to_string(bvh_.objects()));
    for (std::size_t i = 0; i < reading.objects.size(); ++i) {
      const auto object = bvh_.object(i);
      if (!object) return invalid_input("object " + std::to_string(i) + " of the BVH: " + to_string(object.error()));
      const std::string location = "object " + std::to_string(i) + ", ";
      if (auto fits = check_geometries(location, reading.objects[i], *object); !fits)
        return tl::unexpected(fits.error());
    }
    return reading;
  }

  /// @param location of the geometries.
  build::Result<void> check_geometries(const std::string& location, const std::vector<NamedSurface>& geometries,
                                       const BufferView& view) const {
    if (geometries.size() != view.geometries.size())
      return invalid_input(
          (location.empty() ? inputs_[0] + (inputs_.size() > 1 ? " and the other files make " : " makes ")
                            : location + "which has ") +
          std::to_string(geometries.size()) + " geometries, that of the BVH " + std::to_string(view.geometries.size()));
    for (std::size_t i = 0; i < geometries.size(); ++i) {
      const std::uint64_t primitives = geometries[i].surface.primitives();
      const bool shapes = geometries[i].surface.shape_material.has_value();
      const GeometryRecord& record = view.geometries[i];
      const bool moves = !geometries[i].surface.times.empty();
      const bool custom = (record.flags & kGeometryCustom) != 0;
      const bool custom_moves = custom && !view.shapes.empty() && view.shapes[i].kind == ShapeKind::kMovingTriangles;
      const auto name = [](bool is_shape, bool is_moving) {
        return is_moving ? " moving triangles" : is_shape ? " shapes" : " triangles";
      };
      if (primitives != record.primitive_count || shapes != (custom && !custom_moves) || moves != custom_moves)
        return invalid_input(geometries[i].name + ": " + location + "geometry " + std::to_string(i) + " has " +
                             std::to_string(primitives) + name(shapes, moves) + ", that of the BVH " +
                             std::to_string(record.primitive_count) + name(custom, custom_moves));
    }
    return {};
  }

  std::span<const std::string> inputs_;
  const BuiltScene& bvh_;
  const std::string& output_;
};

/// The surfaces without their names. @param groups of the BVH, which have none.
SceneSurfaces result_of(Reading reading, std::size_t groups) {
  SceneSurfaces result{
      std::move(reading.library.textures), std::move(reading.library.materials), {}, std::move(reading.warnings)};
  for (auto& object : reading.objects) {
    auto& geometries = result.objects.emplace_back();
    for (NamedSurface& named : object) geometries.push_back(std::move(named.surface));
  }
  result.objects.resize(result.objects.size() + groups);
  return result;
}

build::Result<SceneSurfaces> load(std::span<const std::string> inputs, const BuiltScene& bvh,
                                  const std::string& output) {
  try {
    auto reading = SurfaceReader(inputs, bvh, output).read();
    if (!reading) return tl::unexpected(std::move(reading.error()));
    return result_of(std::move(*reading), bvh.groups());
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(inputs[0], "to read it", failure));
  }
}

}  // namespace

build::Result<SceneSurfaces> load_surfaces(std::span<const std::string> inputs, const BufferView& bvh,
                                           const std::string& output) {
  return load(inputs, BuiltScene(bvh), output);
}

build::Result<SceneSurfaces> load_surfaces(std::span<const std::string> inputs, std::span<const build::Buffer> objects,
                                           const std::string& output) {
  return load(inputs, BuiltScene(objects), output);
}

}  // namespace hiprt::tools
