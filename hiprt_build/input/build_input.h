#pragma once
/// The input of a build on the host. Internal.

#include <hiprt_build/input.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_device/format/buffer.h>

#include <vector>

namespace hiprt::build {

/// A scene with the numbering of its primitives.
struct BuildInput {
  std::span<const TriangleMesh> meshes;
  std::span<const CustomGeometry> customs;
  std::vector<GeometryView> geometries;  ///< Meshes first.

  /// @pre check_sizes() accepts the scene.
  explicit BuildInput(const SceneInput& scene) : meshes(scene.meshes), customs(scene.customs) {
    geometries.reserve(meshes.size() + customs.size());
    for (const TriangleMesh& mesh : meshes)
      add({mesh.positions.data(), mesh.triangles.data(), nullptr, narrow(mesh.positions.size()),
           narrow(mesh.triangles.size()), 0, mesh.mask, 0});
    for (const CustomGeometry& custom : customs)
      add({nullptr, nullptr, custom.boxes.data(), 0, narrow(custom.boxes.size()), 0, custom.mask,
           custom_geometry_flags(custom.type)});
  }

  std::uint32_t primitive_count() const { return primitive_count_; }
  bool is_custom(std::size_t geometry) const { return geometry >= meshes.size(); }
  GeometryTable table() const { return {geometries.data(), narrow(geometries.size()), primitive_count_}; }

 private:
  static std::uint32_t narrow(std::size_t count) { return static_cast<std::uint32_t>(count); }
  void add(GeometryView geometry) {
    geometry.first = primitive_count_;
    primitive_count_ += geometry.primitive_count;
    geometries.push_back(geometry);
  }

  std::uint32_t primitive_count_ = 0;
};

}  // namespace hiprt::build
