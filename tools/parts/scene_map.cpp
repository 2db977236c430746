#include <tools/parts/scene_map.h>

#include <hiprt_build/format/view.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

namespace hiprt::tools {
namespace {

/// Memory of an instance: its record, and its leaf and nodes in the tree.
constexpr std::uint64_t kInstanceBytes = 192;

Bounds bounds_of(const build::Buffer& file) {
  Bounds bounds;
  const auto view = open_buffer(std::as_const(file).bytes());
  if (!view || view->header->root == kInvalidRef) return bounds;
  const Box& box = view->header->bounds;
  for (const auto& corner : {box.min, box.max})
    bounds.add(std::array{double{corner[0]}, double{corner[1]}, double{corner[2]}});
  return bounds;
}

bool emits(const SceneSurfaces& surfaces, const std::vector<GeometrySurface>& geometries) {
  const auto is_light = [&](std::uint32_t material) {
    const auto& emission = surfaces.materials[material].emission;
    return std::any_of(emission.begin(), emission.end(), [](float channel) { return channel > 0.0f; });
  };
  return std::any_of(geometries.begin(), geometries.end(), [&](const GeometrySurface& geometry) {
    return std::any_of(geometry.materials.begin(), geometry.materials.end(), is_light) ||
           (geometry.shape_material && is_light(*geometry.shape_material));
  });
}

}  // namespace

void Bounds::add(const std::array<double, 3>& point) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    min[axis] = std::min(min[axis], point[axis]);
    max[axis] = std::max(max[axis], point[axis]);
  }
}

void Bounds::add(const Bounds& other) {
  if (other.empty()) return;
  add(other.min);
  add(other.max);
}

Bounds Bounds::transformed(const Transform& transform) const {
  Bounds result;
  for (unsigned corner = 0; !empty() && corner < 8; ++corner) {
    std::array<double, 3> point{};
    for (unsigned row = 0; row < 3; ++row) {
      point[row] = transform.m[row][3];
      for (unsigned k = 0; k < 3; ++k) point[row] += transform.m[row][k] * ((corner >> k & 1u) != 0 ? max[k] : min[k]);
    }
    result.add(point);
  }
  return result;
}

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

SceneMap::SceneMap(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces)
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

std::uint64_t SceneMap::bytes(std::uint32_t object) const {
  std::uint64_t sum = kInstanceBytes;
  for (const std::uint32_t needed : reached_[object]) sum += bytes_[needed];
  return sum;
}

std::uint64_t SceneMap::bytes_of_all() const { return std::accumulate(bytes_.begin(), bytes_.end(), std::uint64_t{0}); }

SplitInput SceneMap::split_input(std::span<const ScenePiece> pieces) const {
  SplitInput input{{}, reached_, bytes_, kInstanceBytes};
  for (const ScenePiece& piece : pieces) {
    const Bounds box = bounds_[piece.object].transformed(piece.to_scene);
    input.instances.push_back({{box.center(0), box.center(1), box.center(2)}, piece.object});
  }
  return input;
}

void SceneMap::add_group(std::size_t object, const SceneGroup& group) {
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

}  // namespace hiprt::tools
