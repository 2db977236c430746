#include "tracer.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace hiprt::bench::vulkan {
namespace {

/// Rays of one launch. A compute shader's 65535 groups of 64 hold them, the least limit of Vulkan.
constexpr std::size_t kMostRays = 4'000'000;
static_assert(sizeof(Ray) == 40 && sizeof(VulkanHit) == 16, "as in rays.glsl");

}  // namespace

build::Result<Tracer> Tracer::make(std::shared_ptr<Device> device) {
  Tracer result;
  result.device_ = std::move(device);
  for (const bool any_hit : {false, true}) {
    auto pipeline = Pipeline::make(*result.device_, any_hit);
    if (!pipeline) return tl::unexpected(std::move(pipeline.error()));
    (any_hit ? result.any_ : result.closest_) = std::move(*pipeline);
  }
  return result;
}

build::Result<void> Tracer::reserve(std::size_t rays) {
  if (host_rays_.size() >= rays * sizeof(Ray)) return {};
  struct Wanted {
    Buffer& buffer;
    std::size_t bytes;
    VkBufferUsageFlags usage;
    Buffer::Where where;
  };
  constexpr VkBufferUsageFlags kFrom = VK_BUFFER_USAGE_TRANSFER_SRC_BIT, kTo = VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                               kShader = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  for (const Wanted& wanted : {Wanted{rays_, rays * sizeof(Ray), kShader | kTo, Buffer::Where::kDevice},
                               {results_, rays * sizeof(VulkanHit), kShader | kFrom, Buffer::Where::kDevice},
                               {host_results_, rays * sizeof(VulkanHit), kTo, Buffer::Where::kReadBack},
                               {host_rays_, rays * sizeof(Ray), kFrom, Buffer::Where::kUpload}}) {
    wanted.buffer = {};
    auto made = Buffer::make(*device_, wanted.bytes, wanted.usage, wanted.where);
    if (!made) return tl::unexpected(std::move(made.error()));
    wanted.buffer = std::move(*made);
  }
  return {};
}

build::Result<std::vector<double>> Tracer::trace(const Scene& scene, bool any_hit, std::span<const Ray> rays,
                                                 unsigned times) {
  const std::size_t most = std::min(kMostRays, static_cast<std::size_t>(device_->facts().buffer_range / sizeof(Ray)));
  hits_.resize(rays.size());
  if (auto done = reserve(std::min(most, rays.size())); !done) return tl::unexpected(std::move(done.error()));
  std::vector<double> seconds(times);
  for (std::size_t begin = 0; begin < rays.size(); begin += most) {
    const std::size_t count = std::min(most, rays.size() - begin);
    if (auto part = trace_part(scene, any_hit ? any_ : closest_, rays.subspan(begin, count),
                               std::span(hits_).subspan(begin, count), seconds);
        !part)
      return tl::unexpected(std::move(part.error()));
  }
  return seconds;
}

/// Adds to @p seconds, one for each time.
build::Result<void> Tracer::trace_part(const Scene& scene, Pipeline& pipeline, std::span<const Ray> rays,
                                       std::span<VulkanHit> hits, std::span<double> seconds) {
  const auto copy = [&](const Buffer& from, const Buffer& to, std::size_t bytes) {
    return device_->run([&](VkCommandBuffer commands) {
      const VkBufferCopy all{0, 0, bytes};
      device_->api().CmdCopyBuffer(commands, from.handle(), to.handle(), 1, &all);
      device_->barrier(commands);
    });
  };
  std::memcpy(host_rays_.mapped(), rays.data(), rays.size_bytes());
  if (auto copied = copy(host_rays_, rays_, rays.size_bytes()); !copied)
    return tl::unexpected(std::move(copied.error()));
  pipeline.bind(scene.top(), rays_, results_);
  for (double& time : seconds) {
    const auto ran = device_->run([&](VkCommandBuffer commands) {
      pipeline.dispatch(commands, static_cast<std::uint32_t>(rays.size()));
      device_->barrier(commands);
    });
    if (!ran) return tl::unexpected(ran.error());
    time += *ran;
  }
  if (auto copied = copy(results_, host_results_, hits.size_bytes()); !copied)
    return tl::unexpected(std::move(copied.error()));
  std::memcpy(hits.data(), host_results_.mapped(), hits.size_bytes());
  return {};
}

}  // namespace hiprt::bench::vulkan
