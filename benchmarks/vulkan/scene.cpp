#include "scene.h"

#include "physical.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace hiprt::bench::vulkan {
namespace {

constexpr VkBufferUsageFlags kInput =
    VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;

/// All positions and all triangles, one mesh after the other.
struct Joined {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
};

Joined join(std::span<const std::vector<build::TriangleMesh>> objects) {
  Joined all;
  for (const auto& object : objects)
    for (const build::TriangleMesh& mesh : object) {
      const auto positions = mesh.positions.contiguous();
      const auto triangles = mesh.triangles.contiguous();
      all.positions.insert(all.positions.end(), positions.begin(), positions.end());
      all.triangles.insert(all.triangles.end(), triangles.begin(), triangles.end());
    }
  return all;
}

}  // namespace

build::Result<Scene> Scene::make(Device& device, const VulkanInput& input) {
  Scene scene;
  scene.device_ = &device;
  scene.instances_.assign(input.instances.begin(), input.instances.end());
  const BuildFlags flags{input.mode == "fast_build" ? Preference::kFastBuild : Preference::kFastTrace,
                         input.compactable};
  if (auto done = scene.copy_meshes(input.objects); !done) return tl::unexpected(std::move(done.error()));
  auto bottom = Structures::make(device, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, flags,
                                 scene.bottom_inputs(input.objects));
  if (!bottom) return tl::unexpected(std::move(bottom.error()));
  scene.bottom_ = std::move(*bottom);
  if (auto done = scene.make_top(flags); !done) return tl::unexpected(std::move(done.error()));
  scene.built_bytes_ = scene.bytes().now;
  scene.scratch_bytes_ = std::max(scene.bottom_.scratch_bytes(), scene.top_.scratch_bytes());
  return scene;
}

build::Result<void> Scene::copy_meshes(std::span<const std::vector<build::TriangleMesh>> objects) {
  const Joined all = join(objects);
  auto positions = upload(*device_, std::as_bytes(std::span(all.positions)), kInput);
  if (!positions) return tl::unexpected(std::move(positions.error()));
  positions_ = std::move(*positions);
  auto triangles = upload(*device_, std::as_bytes(std::span(all.triangles)), kInput);
  if (!triangles) return tl::unexpected(std::move(triangles.error()));
  triangles_ = std::move(*triangles);
  return {};
}

std::vector<Structures::Input> Scene::bottom_inputs(std::span<const std::vector<build::TriangleMesh>> objects) const {
  std::vector<Structures::Input> inputs;
  VkDeviceAddress positions = positions_.address(), triangles = triangles_.address();
  for (const auto& object : objects) {
    Structures::Input& input = inputs.emplace_back();
    for (const build::TriangleMesh& mesh : object) {
      auto geometry =
          structure<VkAccelerationStructureGeometryKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR);
      geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
      geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
      auto data = structure<VkAccelerationStructureGeometryTrianglesDataKHR>(
          VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR);
      data.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
      data.vertexData.deviceAddress = positions;
      data.vertexStride = sizeof(build::Position);
      data.maxVertex = static_cast<std::uint32_t>(std::max<std::size_t>(1, mesh.positions.size()) - 1);
      data.indexType = VK_INDEX_TYPE_UINT32;
      data.indexData.deviceAddress = triangles;
      geometry.geometry.triangles = data;
      input.geometries.push_back(geometry);
      // No ray sees a mesh whose mask is 0.
      input.counts.push_back(mesh.mask == 0 ? 0 : static_cast<std::uint32_t>(mesh.triangles.size()));
      positions += mesh.positions.size() * sizeof(build::Position);
      triangles += mesh.triangles.size() * sizeof(build::Triangle);
    }
  }
  return inputs;
}

build::Result<void> Scene::make_top(BuildFlags flags) {
  auto records = Buffer::make(*device_, instances_.size() * sizeof(VkAccelerationStructureInstanceKHR),
                              kInput | VK_BUFFER_USAGE_TRANSFER_DST_BIT, Buffer::Where::kDevice);
  if (!records) return tl::unexpected(std::move(records.error()));
  records_ = std::move(*records);
  auto geometry = structure<VkAccelerationStructureGeometryKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR);
  geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
  auto data = structure<VkAccelerationStructureGeometryInstancesDataKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR);
  data.data.deviceAddress = records_.address();
  geometry.geometry.instances = data;
  auto top = Structures::make(*device_, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, flags,
                              {{{geometry}, {static_cast<std::uint32_t>(instances_.size())}}});
  if (!top) return tl::unexpected(std::move(top.error()));
  top_ = std::move(*top);
  return write_instances();
}

build::Result<void> Scene::write_instances() {
  std::vector<VkDeviceAddress> addresses(bottom_.size());
  for (std::size_t i = 0; i < addresses.size(); ++i) addresses[i] = bottom_.address(i);
  std::vector<VkAccelerationStructureInstanceKHR> records(instances_.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    static_assert(sizeof(records[i].transform) == sizeof(instances_[i].to_scene));
    std::memcpy(&records[i].transform, &instances_[i].to_scene, sizeof(records[i].transform));
    records[i].mask = instances_[i].mask != 0 ? 0xff : 0;
    records[i].accelerationStructureReference = addresses[instances_[i].object];
  }
  const auto staging = upload(*device_, std::as_bytes(std::span(records)), VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
  if (!staging) return tl::unexpected(staging.error());
  const auto copied = device_->run([&](VkCommandBuffer commands) {
    const VkBufferCopy all{0, 0, std::min(staging->size(), records_.size())};
    device_->api().CmdCopyBuffer(commands, staging->handle(), records_.handle(), 1, &all);
  });
  if (!copied) return tl::unexpected(copied.error());
  return {};
}

build::Result<VulkanSeconds> Scene::build() {
  const auto objects = bottom_.build();
  if (!objects) return tl::unexpected(objects.error());
  const auto instances = top_.build();
  if (!instances) return tl::unexpected(instances.error());
  return VulkanSeconds{*objects, *instances};
}

build::Result<VulkanSeconds> Scene::compact() {
  const auto objects = bottom_.compact();
  if (!objects) return tl::unexpected(objects.error());
  // The objects have other addresses now.
  if (auto done = write_instances(); !done) return tl::unexpected(std::move(done.error()));
  if (const auto rebuilt = top_.build(); !rebuilt) return tl::unexpected(rebuilt.error());
  const auto instances = top_.compact();
  if (!instances) return tl::unexpected(instances.error());
  bottom_.free_scratch();
  top_.free_scratch();
  positions_ = {};
  triangles_ = {};
  return VulkanSeconds{*objects, *instances};
}

}  // namespace hiprt::bench::vulkan
