#include "vulkan_peers.h"

#include "file_triangles.h"
#include "ray_result.h"

#include <hiprt_device/instances/transform.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

namespace hiprt::bench {
namespace {

/// Meshes of one file: a geometry each.
struct FileMeshes {
  std::vector<build::Position> corners;
  std::vector<build::Triangle> triangles;  ///< Of the largest geometry: {0, 1, 2}, {3, 4, 5}, ...

  explicit FileMeshes(const BufferView& file) : corners(file_triangles(file)) {
    std::uint64_t most = 0;
    for (const GeometryRecord& geometry : file.geometries) most = std::max(most, geometry.primitive_count);
    for (std::uint32_t i = 0; i < most; ++i) triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }

  std::vector<build::TriangleMesh> views(const BufferView& file) const {
    std::vector<build::TriangleMesh> meshes;
    for (const GeometryRecord& geometry : file.geometries) {
      const auto first = static_cast<std::size_t>(geometry.first_primitive);
      const auto count = static_cast<std::size_t>(geometry.primitive_count);
      meshes.push_back({.positions = std::span(corners).subspan(3 * first, 3 * count),
                        .triangles = std::span(triangles).first(count),
                        .mask = geometry.mask});
    }
    return meshes;
  }
};

/// Why Vulkan cannot trace the scene; empty: it can.
std::string obstacle(const Tree& tree) {
  const FileHeader& header = *tree.view.header;
  if ((header.features & feature_bit(Feature::kCustom)) != 0) return "it has custom primitives";
  if ((header.features & feature_bit(Feature::kMotion)) != 0) return "it moves";
  if (header.levels > 1) return std::to_string(header.levels) + " levels of instances, but Vulkan supports 1";
  return {};
}

build::Instance instance_of(const InstanceRecord& record) {
  build::Instance instance{.object = record.object, .mask = record.mask};
  for (unsigned column = 0; column < 3; ++column) {
    Vec3D axis(0.0);
    axis[column] = 1;
    const Vec3D turned = vector_to_scene(record, axis);
    for (unsigned row = 0; row < 3; ++row) instance.to_scene.row[row][column] = static_cast<float>(turned[row]);
  }
  for (unsigned row = 0; row < 3; ++row) instance.to_scene.row[row][3] = record.translation[row];
  return instance;
}

RayResult result_of(const VulkanHit& found) {
  Hit hit;
  if (found.found()) {
    hit.t = found.t;
    hit.geometry = found.geometry;
    hit.primitive = found.primitive;
  }
  return make_result(hit);
}

std::string with_spaces(std::string mode) {
  std::replace(mode.begin(), mode.end(), '_', ' ');
  return mode;
}

}  // namespace

VulkanPeers::VulkanPeers(std::shared_ptr<VulkanMachine> machine, const std::vector<std::string>& modes)
    : machine_(std::move(machine)) {
  for (const std::string& mode : modes) peers_.push_back({mode, nullptr, {}});
}

bool VulkanPeers::set_tree(const Tree& tree) {
  if (std::exchange(scene_, tree.scene) == tree.scene) return false;
  for (Peer& peer : peers_) peer.scene.reset();
  std::string why = obstacle(tree);
  if (why.empty())
    if (const auto built = build(tree); !built) why = built.error().message;
  if (!why.empty()) notes_.push_back("Vulkan, " + tree.scene + ": not measured: " + why);
  return why.empty();
}

build::Result<void> VulkanPeers::build(const Tree& tree) {
  std::vector<BufferView> files;
  std::vector<build::Instance> instances;
  for (const ObjectRecord& object : tree.view.objects) {
    const auto view = open_buffer(tree.view.object_file(object));
    if (!view) return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, to_string(view.error())});
    files.push_back(*view);
  }
  for (const InstanceRecord& record : tree.view.instances) instances.push_back(instance_of(record));
  if (!tree.view.has_instances()) {
    files.push_back(tree.view);
    instances.emplace_back();
  }
  std::vector<FileMeshes> meshes;
  std::vector<std::vector<build::TriangleMesh>> objects;
  for (const BufferView& file : files) meshes.emplace_back(file);
  for (std::size_t i = 0; i < files.size(); ++i) objects.push_back(meshes[i].views(files[i]));
  for (Peer& peer : peers_) {
    auto scene = machine_->make_scene({peer.mode, objects, instances});
    if (!scene) return tl::unexpected(std::move(scene.error()));
    if (auto built = (*scene)->build(); !built) return tl::unexpected(std::move(built.error()));
    if (auto compacted = (*scene)->compact(); !compacted) return tl::unexpected(std::move(compacted.error()));
    peer.scene = std::move(*scene);
  }
  return {};
}

void VulkanPeers::run(const RayBuffer& rays, std::span<const Ray> traced, const HostResults& host,
                      const Repetitions& repetitions) {
  for (Peer& peer : peers_)
    if (const auto done = run(peer, rays, traced, host, repetitions); !done)
      notes_.push_back("Vulkan, " + peer.mode + ", " + scene_ + ", " + rays.kind + ": " + done.error().message);
}

build::Result<void> VulkanPeers::run(Peer& peer, const RayBuffer& rays, std::span<const Ray> traced,
                                     const HostResults& host, const Repetitions& repetitions) {
  auto seconds = peer.scene->trace(rays.any_hit, traced, repetitions.warm_up + repetitions.timed);
  if (!seconds) return tl::unexpected(std::move(seconds.error()));
  seconds->erase(seconds->begin(), seconds->begin() + repetitions.warm_up);
  std::sort(seconds->begin(), seconds->end());
  std::vector<RayResult> results(traced.size());
  std::transform(peer.scene->hits().begin(), peer.scene->hits().end(), results.begin(), result_of);
  const double median = (*seconds)[seconds->size() / 2];
  peer.cells[scene_][rays.kind] = {1e-6 * static_cast<double>(traced.size()) / median, host.compare(results),
                                   rays.any_hit};
  return {};
}

bool VulkanPeers::empty() const {
  return std::all_of(peers_.begin(), peers_.end(), [](const Peer& peer) { return peer.cells.empty(); });
}

nlohmann::json VulkanPeers::peer_json(const Peer& peer) const {
  const nlohmann::json device = machine_->describe();
  nlohmann::json speeds, differing;
  std::uint64_t checked = 0, unlike = 0;
  for (const auto& [scene, kinds] : peer.cells)
    for (const auto& [kind, cell] : kinds) {
      const std::uint64_t count = cell.any_hit ? cell.compared.wrong : cell.compared.other_primitives;
      speeds[scene][kind] = cell.mrays_s;
      differing[scene][kind] = count;
      checked += cell.compared.checked;
      unlike += count;
    }
  return {{"name", "Vulkan, " + with_spaces(peer.mode)},
          {"group", "vulkan"},
          {"source", device["device"].get<std::string>() + ", driver " + device["driver"].get<std::string>() +
                         ", rays by " + device["calls"].get<std::string>() + "; " + std::to_string(unlike) + " of " +
                         std::to_string(checked) + " compared rays hit another triangle than the host's, or miss"},
          {"mrays_s", std::move(speeds)},
          {"differing_rays", std::move(differing)}};
}

nlohmann::json VulkanPeers::to_json(const nlohmann::json& context, const Repetitions& repetitions) const {
  nlohmann::json json = context;
  json["format"] = "hiprt peers 1";
  json["gpu"] = machine_->describe()["device"];
  json["vulkan"] = machine_->describe();
  json["method"] =
      "Vulkan: the rays of the variants in the same order and the same run, 40 bytes per ray, 16 per result "
      "{t, instance, geometry, primitive}; timestamps around each launch, median of " +
      std::to_string(repetitions.timed) +
      " launches after warm-up; compacted structures; any-hit kinds end at the first hit";
  json["peers"] = nlohmann::json::array();
  for (const Peer& peer : peers_)
    if (!peer.cells.empty()) json["peers"].push_back(peer_json(peer));
  return json;
}

}  // namespace hiprt::bench
