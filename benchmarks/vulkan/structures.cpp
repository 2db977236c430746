#include "structures.h"

#include "physical.h"

#include <algorithm>
#include <utility>

namespace hiprt::bench::vulkan {
namespace {

/// Of acceleration structures in their buffer (the specification's number).
constexpr std::uint64_t kStructureAlignment = 256;
/// Structures whose scratch memory exceeds this together are built one after the other.
constexpr std::uint64_t kScratchLimit = std::uint64_t{1} << 28;

std::uint64_t aligned(std::uint64_t value, std::uint64_t alignment) {
  return (value + alignment - 1) / alignment * alignment;
}

}  // namespace

build::Result<StructureSet> StructureSet::make(Device& device, VkAccelerationStructureTypeKHR type,
                                               std::span<const std::uint64_t> sizes) {
  StructureSet result;
  result.device_ = &device;
  std::uint64_t end = 0;
  for (const std::uint64_t size : sizes) {
    end += aligned(size, kStructureAlignment);
    result.bytes_ += size;
  }
  auto buffer = Buffer::make(
      device, end, VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
      Buffer::Where::kDevice);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  result.buffer_ = std::move(*buffer);
  std::uint64_t begin = 0;
  for (const std::uint64_t size : sizes) {
    auto info =
        structure<VkAccelerationStructureCreateInfoKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR);
    info.buffer = result.buffer_.handle();
    info.offset = begin;
    info.size = size;
    info.type = type;
    VkAccelerationStructureKHR made = VK_NULL_HANDLE;
    if (auto done = check(device.api().CreateAccelerationStructureKHR(device.handle(), &info, nullptr, &made),
                          "vkCreateAccelerationStructureKHR");
        !done)
      return tl::unexpected(std::move(done.error()));
    result.handles_.push_back(made);
    begin += aligned(size, kStructureAlignment);
  }
  return result;
}

StructureSet::~StructureSet() {
  for (VkAccelerationStructureKHR handle : handles_)
    device_->api().DestroyAccelerationStructureKHR(device_->handle(), handle, nullptr);
}

void StructureSet::swap(StructureSet& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(buffer_, other.buffer_);
  std::swap(handles_, other.handles_);
  std::swap(bytes_, other.bytes_);
}

build::Result<Structures> Structures::make(Device& device, VkAccelerationStructureTypeKHR type, BuildFlags flags,
                                           std::vector<Input> inputs) {
  Structures result;
  result.device_ = &device;
  result.type_ = type;
  result.flags_ = flags;
  result.inputs_ = std::move(inputs);
  std::vector<std::uint64_t> sizes;
  if (auto done = result.measure(sizes); !done) return tl::unexpected(std::move(done.error()));
  auto set = StructureSet::make(device, type, sizes);
  if (!set) return tl::unexpected(std::move(set.error()));
  result.set_ = std::move(*set);
  if (auto done = result.plan(); !done) return tl::unexpected(std::move(done.error()));
  return result;
}

build::Result<void> Structures::measure(std::vector<std::uint64_t>& sizes) {
  const bool bottom = type_ == VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
  const std::uint64_t most = bottom ? device_->facts().most_primitives : device_->facts().most_instances;
  for (const Input& input : inputs_) {
    std::uint64_t count = 0;
    for (const std::uint32_t of : input.counts) count += of;
    if (count > most)
      return tl::unexpected(
          build::Error{build::ErrorCode::kTooLarge, std::to_string(count) + (bottom ? " triangles" : " instances") +
                                                        ", but the Vulkan driver supports " + std::to_string(most)});
  }
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const auto wanted = info(i);
    auto found = structure<VkAccelerationStructureBuildSizesInfoKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR);
    device_->api().GetAccelerationStructureBuildSizesKHR(
        device_->handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &wanted, inputs_[i].counts.data(), &found);
    sizes.push_back(found.accelerationStructureSize);
    scratch_sizes_.push_back(found.buildScratchSize);
  }
  return device_->complaints();
}

build::Result<void> Structures::plan() {
  const std::uint64_t alignment = device_->facts().scratch_alignment;
  std::uint64_t used = 0, most = 0;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const std::uint64_t size = aligned(scratch_sizes_[i], alignment);
    if (batches_.empty() || used + size > kScratchLimit) {
      batches_.push_back({i, i});
      used = 0;
    }
    batches_.back().end = i + 1;
    scratch_begins_.push_back(used);
    used += size;
    most = std::max(most, used);
  }
  auto scratch = Buffer::make(*device_, most + alignment,
                              VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                              Buffer::Where::kDevice);
  if (!scratch) return tl::unexpected(std::move(scratch.error()));
  scratch_ = std::move(*scratch);
  scratch_address_ = aligned(scratch_.address(), alignment);
  return {};
}

VkAccelerationStructureBuildGeometryInfoKHR Structures::info(std::size_t i) const {
  auto result = structure<VkAccelerationStructureBuildGeometryInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR);
  result.type = type_;
  result.flags = flags_.preference == Preference::kFastBuild
                     ? VkBuildAccelerationStructureFlagsKHR{VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR}
                     : VkBuildAccelerationStructureFlagsKHR{VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR};
  if (flags_.compactable) result.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_KHR;
  result.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
  result.geometryCount = static_cast<std::uint32_t>(inputs_[i].geometries.size());
  result.pGeometries = inputs_[i].geometries.data();
  return result;
}

void Structures::record(VkCommandBuffer commands, const Batch& batch) const {
  std::vector<VkAccelerationStructureBuildGeometryInfoKHR> infos;
  std::vector<std::vector<VkAccelerationStructureBuildRangeInfoKHR>> ranges;
  std::vector<const VkAccelerationStructureBuildRangeInfoKHR*> pointers;
  for (std::size_t i = batch.begin; i < batch.end; ++i) {
    infos.push_back(info(i));
    infos.back().dstAccelerationStructure = set_.handles()[i];
    infos.back().scratchData.deviceAddress = scratch_address_ + scratch_begins_[i];
    ranges.emplace_back();
    for (const std::uint32_t count : inputs_[i].counts) ranges.back().push_back({count, 0, 0, 0});
  }
  for (const auto& range : ranges) pointers.push_back(range.data());
  device_->api().CmdBuildAccelerationStructuresKHR(commands, static_cast<std::uint32_t>(infos.size()), infos.data(),
                                                   pointers.data());
}

build::Result<double> Structures::build() {
  return device_->run([&](VkCommandBuffer commands) {
    for (const Batch& batch : batches_) {
      record(commands, batch);
      device_->barrier(commands);
    }
  });
}

build::Result<std::vector<std::uint64_t>> Structures::compact_sizes() {
  const Api& api = device_->api();
  const auto count = static_cast<std::uint32_t>(size());
  auto info = structure<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  info.queryType = VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
  info.queryCount = count;
  VkQueryPool pool = VK_NULL_HANDLE;
  if (auto done = check(api.CreateQueryPool(device_->handle(), &info, nullptr, &pool), "vkCreateQueryPool"); !done)
    return tl::unexpected(std::move(done.error()));
  const auto ran = device_->run([&](VkCommandBuffer commands) {
    api.CmdResetQueryPool(commands, pool, 0, count);
    api.CmdWriteAccelerationStructuresPropertiesKHR(commands, count, set_.handles().data(), info.queryType, pool, 0);
  });
  std::vector<std::uint64_t> sizes(size());
  auto done = ran ? check(api.GetQueryPoolResults(device_->handle(), pool, 0, count, sizes.size() * sizeof(sizes[0]),
                                                  sizes.data(), sizeof(sizes[0]),
                                                  VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                          "vkGetQueryPoolResults")
                  : build::Result<void>(tl::unexpected(ran.error()));
  api.DestroyQueryPool(device_->handle(), pool, nullptr);
  if (!done) return tl::unexpected(std::move(done.error()));
  return sizes;
}

build::Result<double> Structures::compact() {
  const auto sizes = compact_sizes();
  if (!sizes) return tl::unexpected(sizes.error());
  auto smaller = StructureSet::make(*device_, type_, *sizes);
  if (!smaller) return tl::unexpected(std::move(smaller.error()));
  auto seconds = device_->run([&](VkCommandBuffer commands) {
    for (std::size_t i = 0; i < size(); ++i) {
      auto copy = structure<VkCopyAccelerationStructureInfoKHR>(VK_STRUCTURE_TYPE_COPY_ACCELERATION_STRUCTURE_INFO_KHR);
      copy.src = set_.handles()[i];
      copy.dst = smaller->handles()[i];
      copy.mode = VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_KHR;
      device_->api().CmdCopyAccelerationStructureKHR(commands, &copy);
    }
    device_->barrier(commands);
  });
  if (seconds) set_ = std::move(*smaller);
  return seconds;
}

VkDeviceAddress Structures::address(std::size_t i) const {
  auto info = structure<VkAccelerationStructureDeviceAddressInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR);
  info.accelerationStructure = handle(i);
  return device_->api().GetAccelerationStructureDeviceAddressKHR(device_->handle(), &info);
}

}  // namespace hiprt::bench::vulkan
