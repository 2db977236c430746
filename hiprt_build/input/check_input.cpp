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

/// What is wrong with an array of the caller, or nothing. @param element its bytes.
std::string array_fault(const void* first, std::size_t size, std::size_t stride, std::size_t element) {
  if (size == 0) return {};
  if (first == nullptr) return std::to_string(size) + " elements at the null pointer";
  if (reinterpret_cast<std::uintptr_t>(first) % 4 != 0) return "the array is not aligned to 4 bytes";
  if (stride % 4 != 0 || stride < element || stride > 0xffffffffu)
    return "a stride of " + std::to_string(stride) + " bytes; it must be a multiple of 4, at least " +
           std::to_string(element) + " and below 2^32";
  return {};
}

std::string mesh_fault(const TriangleMesh& mesh) {
  if (auto fault = array_fault(mesh.positions.data(), mesh.positions.size(), mesh.positions.stride(), sizeof(Position));
      !fault.empty())
    return "positions: " + fault;
  if (auto fault = array_fault(mesh.triangles.data(), mesh.triangles.size(), mesh.triangles.stride(), sizeof(Triangle));
      !fault.empty())
    return "triangles: " + fault;
  const std::string positions = std::to_string(mesh.positions.size()) + " positions";
  if (mesh.implicit_triangles && !mesh.triangles.empty())
    return "implicit triangles and " + std::to_string(mesh.triangles.size()) + " given ones; leave triangles empty";
  if (mesh.implicit_triangles && mesh.positions.size() % 3 != 0)
    return positions + ", but implicit triangles need a multiple of 3";
  if (!mesh.implicit_triangles && mesh.triangles.empty() && !mesh.positions.empty())
    return positions + " but no triangles; give triangles, or set implicit_triangles";
  if (mesh.type > kMaxGeometryType)
    return "type " + std::to_string(mesh.type) + ", the limit is " + std::to_string(kMaxGeometryType);
  return {};
}

std::string custom_fault(const CustomGeometry& custom) {
  const BoxSpan& boxes = custom.boxes;
  if (auto fault = array_fault(boxes.data(), boxes.size(), boxes.stride(), sizeof(Box)); !fault.empty())
    return "boxes: " + fault;
  constexpr std::size_t kCorner = sizeof(float[3]);
  if (!boxes.empty() && (boxes.upper() % 4 != 0 || boxes.upper() < kCorner || boxes.upper() > boxes.stride() - kCorner))
    return "boxes: the upper corner is at byte " + std::to_string(boxes.upper()) +
           "; it must be a multiple of 4, from 12 to " + std::to_string(boxes.stride() - kCorner);
  if (custom.type > kMaxGeometryType)
    return "type " + std::to_string(custom.type) + ", the limit is " + std::to_string(kMaxGeometryType);
  return {};
}

/// "mesh 3 (chair.obj)"
std::string named(const char* kind, std::size_t index, std::string_view name) {
  return kind + std::to_string(index) + (name.empty() ? "" : " (" + std::string(name) + ")");
}

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
    if (triangle_count(meshes[m]) >= kMaxMeshTriangles)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(triangle_count(meshes[m])) +
                       " triangles, the limit is " + std::to_string(kMaxMeshTriangles - 1));
    if (meshes[m].positions.size() >= kMaxMeshVertices)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(meshes[m].positions.size()) +
                       " vertices, the limit is " + std::to_string(kMaxMeshVertices - 1));
    primitives += triangle_count(meshes[m]);
  }
  for (const CustomGeometry& custom : scene.customs) primitives += custom.boxes.size();
  if (primitives >= kMaxPrimitives)
    return too_large(std::to_string(primitives) + (scene.customs.empty() ? " triangles" : " primitives") +
                     ", the limit is " + std::to_string(kMaxPrimitives - 1));
  for (std::size_t m = 0; m < meshes.size(); ++m)
    if (const std::string fault = mesh_fault(meshes[m]); !fault.empty())
      return tl::unexpected(invalid(named("mesh ", m, meshes[m].name) + ": " + fault));
  for (std::size_t c = 0; c < scene.customs.size(); ++c)
    if (const std::string fault = custom_fault(scene.customs[c]); !fault.empty())
      return tl::unexpected(invalid(named("custom geometry ", c, scene.customs[c].name) + ": " + fault));
  return {};
}

std::string describe(const BuildInput& input, std::size_t geometry) {
  const bool custom = input.is_custom(geometry);
  const std::size_t index = custom ? geometry - input.meshes.size() : geometry;
  const std::string_view name = custom ? input.customs[index].name : input.meshes[index].name;
  return named(custom ? "custom geometry " : "mesh ", index, name);
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

Result<void> check_pairs(CpuEngine& engine, const BuildInput& input) {
  for (std::size_t m = 0; m < input.meshes.size(); ++m) {
    const std::span<const TrianglePair> pairs = input.meshes[m].pairs;
    const std::size_t triangles = input.meshes[m].triangles.size();
    std::vector<bool> taken(pairs.empty() ? 0 : triangles);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (i % CpuEngine::kChunk == 0) engine.monitor().check();
      for (unsigned k = 0; k < (pairs[i][0] == pairs[i][1] ? 1u : 2u); ++k) {
        const std::uint32_t triangle = pairs[i][k];
        const bool exists = triangle < triangles;
        if (!exists || taken[triangle])
          return tl::unexpected(
              invalid(describe(input, m) + ", pair " + std::to_string(i) + ": triangle " + std::to_string(triangle) +
                      (exists ? " is in an earlier pair, too" : ", but there are " + std::to_string(triangles))));
        taken[triangle] = true;
      }
    }
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
