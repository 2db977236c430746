#include <hiprt_build/hiprt_api/inner_scenes.h>

namespace hiprt::api {

Result<InnerQuestion> InnerQuestion::make(HostBuffers& buffers) {
  auto memory = buffers.take(sizeof(std::uint32_t));
  if (!memory) return tl::unexpected(std::move(memory.error()));
  InnerQuestion question(buffers, std::move(*memory));
  *question.flag() = 0;
  return question;
}

Result<bool> InnerQuestion::answer() {
  if (auto done = memory_->wait(); !done) return tl::unexpected(std::move(done.error()));
  const bool found = *flag() != 0;
  buffers_->give_back(std::move(memory_));
  return found;
}

Result<InnerScenes> find_inner(const SceneArrays& from, hipStream_t stream) {
  InnerScenes inner;
  std::vector<hiprtInstance> instances(from.instance_count);
  auto done = gpu::check(hipMemcpyAsync(instances.data(), from.instances, instances.size() * sizeof(hiprtInstance),
                                        hipMemcpyDeviceToHost, stream),
                         "hipMemcpyAsync", "instances");
  if (done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
  if (!done) return tl::unexpected(std::move(done.error()));
  std::map<const void*, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < from.instance_count; ++i) {
    if (instances[i].type != hiprtInstanceTypeScene) continue;
    if (inner.scene_of.empty()) inner.scene_of.assign(from.instance_count, InnerScenes::kNone);
    const void* const handle = instances[i].scene;
    const auto [at, is_new] = numbers.emplace(handle, static_cast<std::uint32_t>(inner.scenes.size()));
    inner.scene_of[i] = at->second;
    if (!is_new) continue;
    const auto parts = SceneRegistry::instance().find(handle);
    if (!parts) return gpu::fail(ErrorCode::kInvalidInput, "instance ", i, " is of a scene that was not built");
    inner.scenes.push_back({static_cast<const ObjectHeader*>(handle), parts->instances, parts->more, parts->more_count,
                            parts->objects, from.instance_count + inner.objects, nullptr});
    inner.objects += parts->objects;
    inner.instances += parts->instances + parts->more_count;
  }
  return inner;
}

Result<ObjectRecord*> Nesting::enqueue(const ObjectRecord* records, InstanceRecord* copies) {
  const std::uint64_t table_bytes = (instances_ + inner_.objects) * sizeof(ObjectRecord);
  const std::uint64_t links_at = align_up(table_bytes);
  const auto memory = memory_.of_size(links_at + instances_ * sizeof(void*));
  if (!memory) return tl::unexpected(memory.error());
  auto* const table = reinterpret_cast<ObjectRecord*>(*memory);
  auto done =
      gpu::check(hipMemcpyAsync(table, records, instances_ * sizeof(ObjectRecord), hipMemcpyDeviceToDevice, stream_),
                 "hipMemcpyAsync");
  for (InnerScene& scene : inner_.scenes) {
    scene.copy = copies;
    copies += scene.instances + scene.more_count;
    if (done) done = enqueue_inner(scene, table, stream_);
  }
  std::vector<InstanceRecord*> links(instances_, nullptr);
  for (std::size_t i = 0; i < links.size(); ++i)
    if (inner_.scene_of[i] != InnerScenes::kNone) links[i] = inner_.scenes[inner_.scene_of[i]].copy;
  if (done)
    done = gpu::check(hipMemcpyAsync(*memory + links_at, static_cast<const void*>(links.data()),
                                     links.size() * sizeof(void*), hipMemcpyHostToDevice, stream_),
                      "hipMemcpyAsync");
  if (done)
    done = enqueue_links(reinterpret_cast<InstanceRecord* const*>(*memory + links_at), table, instances_, stream_);
  if (!done) return tl::unexpected(std::move(done.error()));
  return table;
}

}  // namespace hiprt::api
