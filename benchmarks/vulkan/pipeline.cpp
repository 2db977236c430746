#include "pipeline.h"

#include "physical.h"
#include "shaders.h"

#include <cstring>
#include <utility>
#include <vector>

namespace hiprt::bench::vulkan {
namespace {

/// As in trace.comp.
constexpr std::uint32_t kGroupSize = 64;

VkShaderStageFlags stages(const Device& device) {
  return device.facts().calls == RayCalls::kQuery ? VK_SHADER_STAGE_COMPUTE_BIT : VK_SHADER_STAGE_RAYGEN_BIT_KHR;
}

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits bit, VkShaderModule module) {
  auto info = structure<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = bit;
  info.module = module;
  info.pName = "main";
  return info;
}

VkRayTracingShaderGroupCreateInfoKHR group(VkRayTracingShaderGroupTypeKHR type, std::uint32_t general,
                                           std::uint32_t closest_hit) {
  auto info =
      structure<VkRayTracingShaderGroupCreateInfoKHR>(VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR);
  info.type = type;
  info.generalShader = general;
  info.closestHitShader = closest_hit;
  info.anyHitShader = info.intersectionShader = VK_SHADER_UNUSED_KHR;
  return info;
}

}  // namespace

build::Result<Pipeline> Pipeline::make(Device& device, bool any_hit) {
  Pipeline result;
  result.device_ = &device;
  auto done = result.make_layout();
  if (done) done = result.make_set();
  if (done)
    done = device.facts().calls == RayCalls::kQuery ? result.make_query_pipeline(any_hit)
                                                    : result.make_ray_pipeline(any_hit);
  if (done) done = device.complaints();
  if (!done) return tl::unexpected(std::move(done.error()));
  return result;
}

Pipeline::~Pipeline() {
  if (device_ == nullptr) return;
  const Api& api = device_->api();
  for (VkShaderModule module : modules_) api.DestroyShaderModule(device_->handle(), module, nullptr);
  api.DestroyPipeline(device_->handle(), pipeline_, nullptr);
  api.DestroyDescriptorPool(device_->handle(), pool_, nullptr);
  api.DestroyPipelineLayout(device_->handle(), layout_, nullptr);
  api.DestroyDescriptorSetLayout(device_->handle(), set_layout_, nullptr);
}

void Pipeline::swap(Pipeline& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(set_layout_, other.set_layout_);
  std::swap(layout_, other.layout_);
  std::swap(pool_, other.pool_);
  std::swap(set_, other.set_);
  std::swap(pipeline_, other.pipeline_);
  std::swap(modules_, other.modules_);
  std::swap(table_, other.table_);
  std::swap(regions_, other.regions_);
}

build::Result<void> Pipeline::make_layout() {
  std::array<VkDescriptorSetLayoutBinding, 3> bindings{};
  for (std::uint32_t i = 0; i < bindings.size(); ++i) {
    bindings[i].binding = i;
    bindings[i].descriptorType =
        i == 0 ? VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bindings[i].descriptorCount = 1;
    bindings[i].stageFlags = stages(*device_);
  }
  auto set = structure<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = static_cast<std::uint32_t>(bindings.size());
  set.pBindings = bindings.data();
  const Api& api = device_->api();
  if (auto done = check(api.CreateDescriptorSetLayout(device_->handle(), &set, nullptr, &set_layout_),
                        "vkCreateDescriptorSetLayout");
      !done)
    return done;
  const VkPushConstantRange count{stages(*device_), 0, sizeof(std::uint32_t)};
  auto layout = structure<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &count;
  return check(api.CreatePipelineLayout(device_->handle(), &layout, nullptr, &layout_), "vkCreatePipelineLayout");
}

build::Result<void> Pipeline::make_set() {
  const std::array<VkDescriptorPoolSize, 2> sizes{
      {{VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1}, {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2}}};
  auto pool = structure<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  pool.maxSets = 1;
  pool.poolSizeCount = static_cast<std::uint32_t>(sizes.size());
  pool.pPoolSizes = sizes.data();
  const Api& api = device_->api();
  if (auto done = check(api.CreateDescriptorPool(device_->handle(), &pool, nullptr, &pool_), "vkCreateDescriptorPool");
      !done)
    return done;
  auto set = structure<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  set.descriptorPool = pool_;
  set.descriptorSetCount = 1;
  set.pSetLayouts = &set_layout_;
  return check(api.AllocateDescriptorSets(device_->handle(), &set, &set_), "vkAllocateDescriptorSets");
}

build::Result<VkShaderModule> Pipeline::module(std::span<const std::uint32_t> code) {
  auto info = structure<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  VkShaderModule made = VK_NULL_HANDLE;
  if (auto done =
          check(device_->api().CreateShaderModule(device_->handle(), &info, nullptr, &made), "vkCreateShaderModule");
      !done)
    return tl::unexpected(std::move(done.error()));
  modules_.push_back(made);
  return made;
}

build::Result<void> Pipeline::make_query_pipeline(bool any_hit) {
  const auto made = module(shaders(any_hit).compute);
  if (!made) return tl::unexpected(made.error());
  auto info = structure<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, *made);
  info.layout = layout_;
  return check(device_->api().CreateComputePipelines(device_->handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline_),
               "vkCreateComputePipelines");
}

build::Result<void> Pipeline::make_ray_pipeline(bool any_hit) {
  const Shaders code = shaders(any_hit);
  std::vector<VkPipelineShaderStageCreateInfo> all;
  for (const auto& [bit, part] : {std::pair{VK_SHADER_STAGE_RAYGEN_BIT_KHR, code.raygen},
                                  {VK_SHADER_STAGE_MISS_BIT_KHR, code.miss},
                                  {VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR, code.closest_hit}}) {
    if (part.empty()) continue;
    const auto made = module(part);
    if (!made) return tl::unexpected(made.error());
    all.push_back(stage(bit, *made));
  }
  const std::array<VkRayTracingShaderGroupCreateInfoKHR, 3> groups{
      group(VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR, 0, VK_SHADER_UNUSED_KHR),
      group(VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR, 1, VK_SHADER_UNUSED_KHR),
      group(VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR, VK_SHADER_UNUSED_KHR,
            any_hit ? VK_SHADER_UNUSED_KHR : 2)};
  auto info = structure<VkRayTracingPipelineCreateInfoKHR>(VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR);
  info.stageCount = static_cast<std::uint32_t>(all.size());
  info.pStages = all.data();
  info.groupCount = static_cast<std::uint32_t>(groups.size());
  info.pGroups = groups.data();
  info.maxPipelineRayRecursionDepth = 1;
  info.layout = layout_;
  if (auto done = check(device_->api().CreateRayTracingPipelinesKHR(device_->handle(), VK_NULL_HANDLE, VK_NULL_HANDLE,
                                                                    1, &info, nullptr, &pipeline_),
                        "vkCreateRayTracingPipelinesKHR");
      !done)
    return done;
  return make_table();
}

build::Result<void> Pipeline::make_table() {
  const std::size_t size = device_->facts().handle_size, stride = device_->facts().base_alignment;
  const auto count = static_cast<std::uint32_t>(regions_.size());
  // Handles are smaller than the alignment of groups in all drivers, but no rule says so.
  const std::size_t step = (size + stride - 1) / stride * stride;
  std::vector<std::byte> handles(count * size);
  if (auto done = check(device_->api().GetRayTracingShaderGroupHandlesKHR(device_->handle(), pipeline_, 0, count,
                                                                          handles.size(), handles.data()),
                        "vkGetRayTracingShaderGroupHandlesKHR");
      !done)
    return done;
  // A buffer's address may be less aligned than groups must be.
  auto table = Buffer::make(*device_, (count + 1) * step,
                            VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                            Buffer::Where::kUpload);
  if (!table) return tl::unexpected(std::move(table.error()));
  table_ = std::move(*table);
  const std::size_t begin = (stride - table_.address() % stride) % stride;
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(table_.mapped() + begin + i * step, handles.data() + i * size, size);
    regions_[i] = {table_.address() + begin + i * step, step, step};
  }
  return {};
}

void Pipeline::bind(VkAccelerationStructureKHR scene, const Buffer& rays, const Buffer& results) {
  auto structures = structure<VkWriteDescriptorSetAccelerationStructureKHR>(
      VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR);
  structures.accelerationStructureCount = 1;
  structures.pAccelerationStructures = &scene;
  const std::array<VkDescriptorBufferInfo, 2> buffers{
      {{rays.handle(), 0, VK_WHOLE_SIZE}, {results.handle(), 0, VK_WHOLE_SIZE}}};
  std::array<VkWriteDescriptorSet, 3> writes{};
  for (std::uint32_t i = 0; i < writes.size(); ++i) {
    writes[i] = structure<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    writes[i].dstSet = set_;
    writes[i].dstBinding = i;
    writes[i].descriptorCount = 1;
    writes[i].descriptorType =
        i == 0 ? VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    if (i == 0)
      writes[i].pNext = &structures;
    else
      writes[i].pBufferInfo = &buffers[i - 1];
  }
  device_->api().UpdateDescriptorSets(device_->handle(), static_cast<std::uint32_t>(writes.size()), writes.data(), 0,
                                      nullptr);
}

void Pipeline::dispatch(VkCommandBuffer commands, std::uint32_t rays) const {
  const Api& api = device_->api();
  const bool query = device_->facts().calls == RayCalls::kQuery;
  const auto point = query ? VK_PIPELINE_BIND_POINT_COMPUTE : VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR;
  api.CmdBindPipeline(commands, point, pipeline_);
  api.CmdBindDescriptorSets(commands, point, layout_, 0, 1, &set_, 0, nullptr);
  if (query) {
    api.CmdPushConstants(commands, layout_, stages(*device_), 0, sizeof(rays), &rays);
    api.CmdDispatch(commands, (rays + kGroupSize - 1) / kGroupSize, 1, 1);
  } else {
    const VkStridedDeviceAddressRegionKHR none{};
    api.CmdTraceRaysKHR(commands, regions_.data(), &regions_[1], &regions_[2], &none, rays, 1, 1);
  }
}

}  // namespace hiprt::bench::vulkan
