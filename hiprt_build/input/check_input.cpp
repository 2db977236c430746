#include <hiprt_build/input/check_input.h>

#include <hiprt_device/format/quantize.h>

namespace hiprt::build {
namespace {

/// Larger meshes have half-edge numbers beyond 32 bits; a file could not address their leaves either.
constexpr std::uint64_t kMaxMeshTriangles = std::uint64_t{1} << 30;
constexpr std::uint64_t kMaxMeshVertices = std::uint64_t{1} << 31;
static_assert(4 * (kMaxMeshTriangles - 2) + 2 < kInvalidId && 3 * (kMaxMeshTriangles - 1) < kInvalidId &&
              2 * (kMaxMeshVertices - 2) + 1 < kInvalidId);
/// References are numbered with 31 bits: a leaf's primitives in the primitive map with 32.
constexpr std::uint64_t kMaxPrimitives = std::uint64_t{1} << 31;

}  // namespace

Result<void> check_sizes(const SceneInput& scene) {
  const auto too_large = [](std::string message) {
    return tl::unexpected(Error{ErrorCode::kTooLarge, std::move(message)});
  };
  const std::span<const TriangleMesh> meshes = scene.meshes;
  if (meshes.size() + scene.customs.size() > kMaxGeometries)
    return too_large(std::to_string(meshes.size() + scene.customs.size()) + " geometries, a file names at most " +
                     std::to_string(kMaxGeometries));
  std::uint64_t primitives = 0;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m].triangles.size() >= kMaxMeshTriangles)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(meshes[m].triangles.size()) +
                       " triangles, the limit is " + std::to_string(kMaxMeshTriangles - 1));
    if (meshes[m].positions.size() >= kMaxMeshVertices)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(meshes[m].positions.size()) +
                       " vertices, the limit is " + std::to_string(kMaxMeshVertices - 1));
    primitives += meshes[m].triangles.size();
  }
  for (const CustomGeometry& custom : scene.customs) primitives += custom.boxes.size();
  if (primitives >= kMaxPrimitives)
    return too_large(std::to_string(primitives) + (scene.customs.empty() ? " triangles" : " primitives") +
                     ", the limit is " + std::to_string(kMaxPrimitives - 1));
  return {};
}

std::string describe(const BuildInput& input, std::size_t geometry) {
  const bool custom = input.is_custom(geometry);
  const std::size_t index = custom ? geometry - input.meshes.size() : geometry;
  const std::string_view name = custom ? input.customs[index].name : input.meshes[index].name;
  return (custom ? "custom geometry " : "mesh ") + std::to_string(index) +
         (name.empty() ? "" : " (" + std::string(name) + ")");
}

std::string describe(const BuildInput& input, std::size_t geometry, std::size_t primitive) {
  return describe(input, geometry) + (input.is_custom(geometry) ? ", primitive " : ", triangle ") +
         std::to_string(primitive) + ": ";
}

Result<void> check_indices(CpuEngine& engine, const BuildInput& input) {
  for (std::size_t m = 0; m < input.meshes.size(); ++m) {
    const TriangleMesh& mesh = input.meshes[m];
    const std::size_t i = engine.find_first(mesh.triangles.size(), [&](std::size_t t) {
      const Triangle& indices = mesh.triangles[t];
      return std::max({indices[0], indices[1], indices[2]}) >= mesh.positions.size();
    });
    if (i == mesh.triangles.size()) continue;
    const Triangle& t = mesh.triangles[i];
    return tl::unexpected(invalid(describe(input, m, i) + "index " +
                                  std::to_string(*std::max_element(t.begin(), t.end())) + ", but there are " +
                                  std::to_string(mesh.positions.size()) + " vertices"));
  }
  return {};
}

Result<void> check_quantizable(CpuEngine& engine, const BuildInput& input, const PairedPrimitives& paired) {
  const std::size_t i = engine.find_first(paired.count, [&](std::size_t k) {
    const SimdBox box = leaf_simd_box(input.table(), paired.leaves[k]);
    bool good = true;
    for (int axis = 0; axis < 3; ++axis)
      good = good && box.min[axis] > -kQuantizedLimit && box.max[axis] < kQuantizedLimit;
    return !good;
  });
  if (i == paired.count) return {};
  const std::uint32_t primitive = paired.leaves[i].primitive, geometry = input.table().find(primitive);
  return tl::unexpected(invalid(describe(input, geometry, primitive - input.geometries[geometry].first) +
                                "a coordinate of 2^126 (8.5e37) or more, which node layout quantized cannot hold; "
                                "float, planes and half can"));
}

}  // namespace hiprt::build
