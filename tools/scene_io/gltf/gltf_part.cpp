#include <tools/scene_io/gltf/gltf_part.h>

#include <tools/base/errors.h>
#include <tools/scene_io/gltf/gltf_accessor.h>
#include <tools/scene_io/mesh/append_mesh.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hiprt::tools {
namespace {

/// Calls emit(a, b, c) for every triangle of a list, strip or fan of n corners (glTF 2.0, 3.7.2.1).
template <class Emit> void for_each_triangle(int mode, std::size_t n, Emit&& emit) {
  if (mode == TINYGLTF_MODE_TRIANGLES)
    for (std::size_t i = 0; i + 3 <= n; i += 3) emit(i, i + 1, i + 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
    for (std::size_t i = 0; i + 3 <= n; ++i) emit(i, i + 1 + i % 2, i + 2 - i % 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
    for (std::size_t i = 1; i + 2 <= n; ++i) emit(i, i + 1, 0);
}

/// Can n corners be what the mode says (glTF 2.0, 3.7.2.1)?
build::Result<void> check_corners(int mode, std::size_t n) {
  if (mode == TINYGLTF_MODE_TRIANGLES && n % 3 != 0)
    return invalid_input(std::to_string(n) + " corners, but a list of triangles needs a multiple of 3");
  if (mode != TINYGLTF_MODE_TRIANGLES && n < 3)
    return invalid_input(std::to_string(n) + " corners, but a strip or fan needs at least 3");
  return {};
}

/// The vertices of all corners, in the primitive's order.
build::Result<std::vector<std::uint32_t>> read_corners(const tinygltf::Model& model,
                                                       const tinygltf::Primitive& primitive, std::size_t vertices) {
  if (primitive.indices < 0) {
    std::vector<std::uint32_t> corners(vertices);
    std::iota(corners.begin(), corners.end(), 0u);
    return corners;
  }
  auto indices = read_indices(model, primitive.indices);
  if (!indices) return indices;
  const auto wrong = std::find_if(indices->begin(), indices->end(), [&](auto c) { return c >= vertices; });
  if (wrong != indices->end())
    return invalid_input("accessor " + std::to_string(primitive.indices) + ": vertex " + std::to_string(*wrong) +
                         ", but the primitive has only " + std::to_string(vertices));
  return indices;
}

/// Vectors of N numbers of an attribute, one per vertex; none if the primitive has no such attribute.
template <std::size_t N>
build::Result<std::vector<std::array<float, N>>> read_attribute(const tinygltf::Model& model,
                                                                const tinygltf::Primitive& primitive, const char* name,
                                                                std::size_t vertices) {
  const auto attribute = primitive.attributes.find(name);
  if (attribute == primitive.attributes.end()) return std::vector<std::array<float, N>>{};
  const auto values = read_vectors(model, attribute->second, N);
  if (!values) return invalid_input(std::string(name) + ": " + values.error().message);
  if (values->size() != N * vertices)
    return invalid_input(std::string(name) + " has " + std::to_string(values->size() / N) +
                         " elements, but POSITION has " + std::to_string(vertices));
  std::vector<std::array<float, N>> result(vertices);
  for (std::size_t i = 0; i < values->size(); ++i) result[i / N][i % N] = static_cast<float>((*values)[i]);
  return result;
}

build::Result<void> read_surface(const tinygltf::Model& model, const tinygltf::Primitive& primitive, GltfPart& part) {
  auto coordinates = read_attribute<2>(model, primitive, "TEXCOORD_0", part.positions.size());
  if (!coordinates) return tl::unexpected(coordinates.error());
  const auto wrong = std::find_if(coordinates->begin(), coordinates->end(),
                                  [](const auto& c) { return !std::isfinite(c[0]) || !std::isfinite(c[1]); });
  if (wrong != coordinates->end())
    return invalid_input("TEXCOORD_0: vertex " + std::to_string(wrong - coordinates->begin()) +
                         " has coordinates that are not finite");
  auto normals = read_attribute<3>(model, primitive, "NORMAL", part.positions.size());
  if (!normals) return tl::unexpected(normals.error());
  part.coordinates = std::move(*coordinates);
  part.normals = std::move(*normals);
  return {};
}

/// Appends an attribute of the vertices. If only some vertices have it, the others get zeros.
template <class T>
void append_attribute(std::vector<T>& all, const std::vector<T>& part, std::size_t before, std::size_t count) {
  if (all.empty() && part.empty()) return;
  all.resize(before);
  all.insert(all.end(), part.begin(), part.end());
  all.resize(before + count);
}

void append_surface(MeshSurface& surface, const GltfPart& part, const Transform& to_world, std::uint32_t material,
                    std::size_t before) {
  const NormalTransform normal_to_world(to_world);
  std::vector<std::array<float, 3>> normals;
  normals.reserve(part.normals.size());
  for (const auto& normal : part.normals) normals.push_back(normal_to_world(normal));
  append_attribute(surface.coordinates, part.coordinates, before, part.positions.size());
  append_attribute(surface.normals, normals, before, part.positions.size());
  surface.materials.insert(surface.materials.end(), part.triangles.size(), material);
}

}  // namespace

bool has_triangles(const tinygltf::Primitive& primitive) {
  return primitive.mode == TINYGLTF_MODE_TRIANGLES || primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
         primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
}

build::Result<GltfPart> read_part(const tinygltf::Model& model, const tinygltf::Primitive& primitive, bool surfaces) {
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end()) return GltfPart{};
  auto positions = read_positions(model, position->second);
  if (!positions) return tl::unexpected(positions.error());
  const auto corners = read_corners(model, primitive, positions->size());
  if (!corners) return tl::unexpected(corners.error());
  if (auto checked = check_corners(primitive.mode, corners->size()); !checked) return tl::unexpected(checked.error());
  GltfPart part{std::move(*positions), {}, {}, {}};
  for_each_triangle(primitive.mode, corners->size(), [&](std::size_t a, std::size_t b, std::size_t c) {
    part.triangles.push_back({(*corners)[a], (*corners)[b], (*corners)[c]});
  });
  if (!surfaces) return part;
  if (auto done = read_surface(model, primitive, part); !done) return tl::unexpected(done.error());
  return part;
}

build::Result<void> append(Mesh& mesh, const GltfPart& part, const Transform& to_world, std::uint32_t material) {
  const auto base = append(mesh, part.positions, part.triangles, to_world);
  if (!base) return tl::unexpected(base.error());
  if (mesh.surface) append_surface(*mesh.surface, part, to_world, material, *base);
  return {};
}

}  // namespace hiprt::tools
