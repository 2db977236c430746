#pragma once
/// The input of a build on the host. Internal.

#include <hiprt_build/input.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_device/format/buffer.h>

#include <vector>

namespace hiprt::build {

/// @return the number of a mesh's triangles.
inline std::size_t triangle_count(const TriangleMesh& mesh) {
  return mesh.implicit_triangles ? mesh.positions.size() / 3 : mesh.triangles.size();
}

/// A scene with the numbering of its primitives.
struct BuildInput {
  std::vector<TriangleMesh> meshes;  ///< With triangles, also where the caller's are implicit.
  std::span<const CustomGeometry> customs;
  std::vector<GeometryView> geometries;  ///< Meshes first.

  /// @pre check_sizes() accepts the scene.
  explicit BuildInput(const SceneInput& scene)
      : meshes(scene.meshes.begin(), scene.meshes.end()), customs(scene.customs) {
    geometries.reserve(meshes.size() + customs.size());
    for (TriangleMesh& mesh : meshes) {
      if (mesh.implicit_triangles) mesh.triangles = make_triangles(triangle_count(mesh));
      GeometryView view =
          GeometryView::of_mesh(mesh.positions.data(), narrow(mesh.positions.size()), narrow(mesh.positions.stride()),
                                mesh.triangles.data(), narrow(mesh.triangles.size()), narrow(mesh.triangles.stride()));
      view.mask = mesh.mask;
      view.flags = mesh_flags(mesh.type);
      view.given_pairs = !mesh.pairs.empty();
      add(view);
    }
    for (const CustomGeometry& custom : customs) {
      GeometryView view =
          GeometryView::of_boxes(custom.boxes.data(), narrow(custom.boxes.size()), narrow(custom.boxes.stride()),
                                 narrow(custom.boxes.upper()), custom.type);
      view.mask = custom.mask;
      // Without boxes there may be no address, but the view is that of custom primitives.
      static const Box kNone{};
      if (view.boxes == nullptr) view.boxes = reinterpret_cast<const std::byte*>(&kNone);
      add(view);
    }
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

  std::span<const Triangle> make_triangles(std::size_t count) {
    std::vector<Triangle>& made = implicit_.emplace_back(count);
    for (std::uint32_t i = 0; i < count; ++i) made[i] = {3 * i, 3 * i + 1, 3 * i + 2};
    return made;
  }

  std::uint32_t primitive_count_ = 0;
  std::vector<std::vector<Triangle>> implicit_;
};

}  // namespace hiprt::build
