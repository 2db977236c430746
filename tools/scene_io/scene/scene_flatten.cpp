#include <tools/scene_io/scene/scene_flatten.h>

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>

#include <hiprt_device/format/buffer.h>

#include <algorithm>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

constexpr std::uint64_t kMostTriangles = (std::uint64_t{1} << 31) - 1;

/// Sums that stop growing far above the limits.
struct Size {
  std::uint64_t geometries = 0, triangles = 0;

  void add(const Size& other) {
    constexpr std::uint64_t kEnough = std::uint64_t{1} << 62;
    geometries = std::min(kEnough, geometries + other.geometries);
    triangles = std::min(kEnough, triangles + other.triangles);
  }
};

build::Result<void> check_size(const SceneDescription& scene, std::size_t object) {
  std::vector<Size> sizes;
  for (const SceneObject& each : scene.objects) {
    Size size;
    for (const std::size_t mesh : each.meshes) size.add({1, scene.meshes[mesh].triangles.size()});
    sizes.push_back(size);
  }
  for (const SceneGroup& group : scene.groups) {
    Size size;
    for (const build::Instance& instance : group.instances) size.add(sizes[instance.object]);
    sizes.push_back(size);
  }
  const auto check = [&](std::uint64_t count, std::uint64_t limit, const char* noun) -> build::Result<void> {
    if (count <= limit) return {};
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, scene.path + ": flattened it has " +
                                                                        std::to_string(count) + " " + noun +
                                                                        ", the limit is " + std::to_string(limit)});
  };
  if (auto within_limit = check(sizes[object].geometries, kMaxGeometries, "geometries"); !within_limit)
    return within_limit;
  return check(sizes[object].triangles, kMostTriangles, "triangles");
}

/// State of a path from the scene to an object.
struct Step {
  std::size_t object;
  Transform to_scene;
  std::uint32_t mask;
};

FlatGeometry transformed(const SceneDescription& scene, std::size_t number, const Step& step) {
  const Mesh& mesh = scene.meshes[number];
  FlatGeometry result{{}, mesh.triangles, step.mask, &mesh.name, number, step.to_scene};
  result.positions.reserve(mesh.positions.size());
  for (const build::Position& position : mesh.positions) result.positions.push_back(step.to_scene(position));
  if (step.to_scene.mirrors())
    for (build::Triangle& triangle : result.triangles) std::swap(triangle[1], triangle[2]);
  return result;
}

/// Puts a group's instances onto the stack, the first on top.
build::Result<void> push_instances(const SceneDescription& scene, const SceneGroup& group, const Step& outer,
                                   std::vector<Step>& stack) {
  for (std::size_t i = group.instances.size(); i-- > 0;) {
    const build::Instance& instance = group.instances[i];
    if (instance.motion != nullptr)
      return invalid_input(scene.path + ": " + group.location + "[" + std::to_string(i) +
                           "] moves, which a flat scene cannot");
    const std::uint32_t both = outer.mask & instance.mask;
    // A ray needs a bit of each of two masks. One mask can say so only if one contains the bits of the other.
    if (both != outer.mask && both != instance.mask)
      return invalid_input(scene.path + ": " + group.location + "[" + std::to_string(i) +
                           "].mask: " + std::to_string(instance.mask) + " below an instance of mask " +
                           std::to_string(outer.mask) + " cannot be flattened, no one mask is the same as both");
    stack.push_back({instance.object, outer.to_scene * to_double(instance.to_scene), both});
  }
  return {};
}

build::Result<std::vector<FlatGeometry>> flatten(const SceneDescription& scene, const Step& whole) {
  if (auto checked = check_size(scene, whole.object); !checked) return tl::unexpected(checked.error());
  std::vector<FlatGeometry> result;
  std::vector<Step> stack{whole};
  while (!stack.empty()) {
    if (interrupted()) return cancelled();
    const Step step = stack.back();
    stack.pop_back();
    if (step.object < scene.objects.size()) {
      const SceneObject& object = scene.objects[step.object];
      if (!object.shapes.empty()) {
        const bool moves = scene.shapes[object.shapes[0]].kind == ShapeKind::kMovingTriangles;
        return invalid_input(
            scene.path + ": " + object.name +
            (moves ? " deforms, which a flat scene cannot: leave out --flatten, or close the shutter (--shutter 1,1)"
                   : " has spheres or curves, which cannot be flattened: a transform may make them other shapes"));
      }
      for (const std::size_t mesh : object.meshes) result.push_back(transformed(scene, mesh, step));
      continue;
    }
    const SceneGroup& group = scene.groups[step.object - scene.objects.size()];
    if (auto pushed = push_instances(scene, group, step, stack); !pushed) return tl::unexpected(pushed.error());
  }
  return result;
}

}  // namespace

build::Result<std::vector<FlatGeometry>> flatten_object(const SceneDescription& scene, std::size_t object,
                                                        const Transform& to_scene, std::uint32_t mask) {
  try {
    return flatten(scene, {object, to_scene, mask});
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(scene.path, "to flatten it", failure));
  }
}

build::Result<std::vector<FlatGeometry>> flatten_scene(const SceneDescription& scene) {
  return flatten_object(scene, scene.objects.size() + scene.groups.size() - 1, {}, 0xffffffffu);
}

Mesh to_mesh(const SceneDescription& scene, FlatGeometry&& geometry) {
  Mesh mesh;
  mesh.name = *geometry.name;
  mesh.positions = std::move(geometry.positions);
  mesh.triangles = std::move(geometry.triangles);
  mesh.surface = scene.meshes[geometry.mesh].surface;
  if (mesh.surface) {
    const NormalTransform normal_to_scene(geometry.to_scene);
    for (auto& normal : mesh.surface->normals) normal = normal_to_scene(normal);
  }
  return mesh;
}

std::vector<build::TriangleMesh> views(std::span<const FlatGeometry> geometries) {
  std::vector<build::TriangleMesh> result;
  result.reserve(geometries.size());
  for (const FlatGeometry& geometry : geometries)
    result.push_back({geometry.positions, geometry.triangles, geometry.mask, *geometry.name});
  return result;
}

}  // namespace hiprt::tools
