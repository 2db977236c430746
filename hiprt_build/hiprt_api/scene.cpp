#include <hiprt_build/hiprt_api/scene.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/hiprt_api/geometry_input.h>
#include <hiprt_build/hiprt_api/inner_scenes.h>

#include <algorithm>

namespace hiprt::api {
namespace {

SceneArrays arrays_of(const hiprtSceneBuildInput& input) {
  return {.instances = static_cast<const hiprtInstance*>(input.instances),
          .headers = static_cast<const hiprtTransformHeader*>(input.instanceTransformHeaders),
          .frames = input.instanceFrames,
          .masks = static_cast<const std::uint32_t*>(input.instanceMasks),
          .instance_count = input.instanceCount,
          .frame_count = input.instanceFrames != nullptr ? input.frameCount : 0,
          .type = input.frameType};
}

/// Trees of the caller are not read: the builder's are as good, and the hits are the same.
gpu::InstanceOptions options_for_instances(const hiprtBuildOptions& options) {
  gpu::InstanceOptions result;
  const BuildKind kind = kind_of(options);
  result.tree.builder = kind == BuildKind::kFast ? build::Builder::kLbvh : build::Builder::kHploc;
  if (kind == BuildKind::kHigh) result.tree.reinsertion_rounds = 8;
  return result;
}

/// Arrays in scratch memory.
struct SceneScratch {
  SceneParts parts{};
  ObjectRecord* records;  ///< Of the instances' objects.
  std::byte* build;

  SceneScratch(gpu::Arena& arena, const SceneArrays& from, std::uint64_t build_bytes) {
    parts.views = arena.take<SceneView>(from.instance_count);
    parts.instances = arena.take<gpu::DeviceInstance>(from.instance_count);
    if (from.may_move()) {
      parts.ranges = arena.take<gpu::KeyRange>(from.instance_count);
      if (from.type == hiprtFrameTypeMatrix)
        parts.matrices = arena.take<build::MatrixKey>(from.frame_count);
      else
        parts.keys = arena.take<build::MotionKey>(from.frame_count);
    }
    records = arena.take<ObjectRecord>(from.instance_count);
    build = arena.take<std::byte>(build_bytes);
  }
};

std::uint32_t key_count(const SceneArrays& from) { return from.may_move() ? from.frame_count : 0; }

/// @param objects of the table.
Result<gpu::BuildSizes> sizes_of(const SceneArrays& from, std::uint32_t objects, const hiprtBuildOptions& options) {
  auto sizes = gpu::instance_sizes(gpu::separate_objects(nullptr, objects), from.instance_count,
                                   options_for_instances(options), key_count(from));
  if (!sizes) return sizes;
  gpu::Arena arena;
  SceneScratch(arena, from, sizes->scratch);
  sizes->scratch = arena.size();
  return sizes;
}

/// Builds of one scene.
class SceneBuild {
 public:
  SceneBuild(const hiprtSceneBuildInput& input, const hiprtBuildOptions& options, Scratch& temporary,
             hipStream_t stream, const Found& found)
      : from_(arrays_of(input)), options_(options), temporary_(temporary), stream_(stream), found_(found) {}

  Result<void> run(HostBuffers& buffers) {
    const SceneRegistry& scenes = SceneRegistry::instance();
    if (!scenes.has_other(found_.header())) return build({});
    const auto known = scenes.find(found_.header());
    if (known && known->objects > known->instances) return build_nested();
    // Most scenes have none inside. Their build runs while the host waits for the answer.
    auto question = InnerQuestion::make(buffers);
    if (!question) return tl::unexpected(std::move(question.error()));
    if (auto built = build({}, &*question); !built) return built;
    const auto has_inner = question->answer();
    if (!has_inner) return tl::unexpected(has_inner.error());
    return *has_inner ? build_nested() : Result<void>();
  }

 private:
  Result<void> build_nested() {
    auto inner = find_inner(from_, stream_);
    return inner ? build(std::move(*inner)) : Result<void>(tl::unexpected(std::move(inner.error())));
  }

  Result<void> build(InnerScenes inner, InnerQuestion* question = nullptr) {
    const std::uint32_t objects = from_.instance_count + inner.objects;
    const auto sizes = sizes_of(from_, objects, options_);
    if (!sizes) return tl::unexpected(sizes.error());
    const std::uint64_t copies_at = align_up(sizes->output);
    if (auto room = found_.pool->reserve(found_.index, copies_at + inner.instances * sizeof(InstanceRecord)); !room)
      return room;
    const auto memory = temporary_.of_size(sizes->scratch);
    if (!memory) return tl::unexpected(memory.error());
    gpu::Arena arena(*memory);
    SceneScratch scratch(arena, from_, 0);
    if (question != nullptr) scratch.parts.has_inner = question->flag();
    auto done = enqueue_parts(from_, scratch.parts, stream_);
    if (done && question != nullptr) done = question->asked(stream_);
    if (done) done = gpu::enqueue_objects(scratch.parts.views, from_.instance_count, scratch.records, stream_);
    if (!done) return done;
    Member& member = found_.member();
    auto* const copies = reinterpret_cast<InstanceRecord*>(member.storage + copies_at);
    const ObjectRecord* table = scratch.records;
    Nesting nesting(inner, from_.instance_count, stream_);
    if (!inner.scenes.empty()) {
      const auto whole = nesting.enqueue(scratch.records, copies);
      if (!whole) return tl::unexpected(whole.error());
      table = *whole;
    }
    gpu::DeviceInstances instances{.instances = scratch.parts.instances, .count = from_.instance_count};
    if (scratch.parts.ranges != nullptr)
      instances.motions = {.ranges = scratch.parts.ranges,
                           .keys = scratch.parts.keys,
                           .matrices = scratch.parts.matrices,
                           .key_count = from_.frame_count};
    const auto report = gpu::enqueue_instances(gpu::separate_objects(table, objects), instances,
                                               options_for_instances(options_), member.storage, scratch.build, stream_);
    if (!report) return tl::unexpected(report.error());
    member.instances = *report;
    member.built = true;
    SceneRegistry::instance().set(found_.header(), {from_.instance_count, objects, copies, inner.instances});
    return enqueue_headers(&(*report)->view, found_.header(), 1, stream_);
  }

  SceneArrays from_;
  const hiprtBuildOptions& options_;
  Scratch& temporary_;
  hipStream_t stream_;
  const Found& found_;
};

}  // namespace

Result<std::uint64_t> temporary_size(SceneInputs inputs, const hiprtBuildOptions& options) {
  std::uint64_t most = 0;
  for (const hiprtSceneBuildInput& input : inputs) {
    const auto sizes = sizes_of(arrays_of(input), input.instanceCount, options);
    if (!sizes) return tl::unexpected(sizes.error());
    most = std::max(most, sizes->scratch);
  }
  // The caller's buffer may be aligned to less.
  return most + kAlignment;
}

Result<void> create_scenes(hiprtContext context, SceneInputs inputs, const hiprtBuildOptions& options,
                           hiprtScene* const* outs) {
  auto pool = std::make_shared<Pool>();
  pool->members.resize(inputs.size());
  std::uint64_t bytes = inputs.size() * sizeof(ObjectHeader);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const auto sizes = sizes_of(arrays_of(inputs[i]), inputs[i].instanceCount, options);
    if (!sizes) return tl::unexpected(sizes.error());
    pool->members[i].capacity = sizes->output;
    bytes += sizes->output;
  }
  auto memory = Allocation::make(bytes);
  if (!memory) return tl::unexpected(std::move(memory.error()));
  pool->memory = std::move(*memory);
  std::byte* at = pool->memory.data() + inputs.size() * sizeof(ObjectHeader);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    pool->members[i].storage = at;
    at += pool->members[i].capacity;
    *outs[i] = pool->header(i);
  }
  context->scenes.add(std::move(pool));
  return {};
}

Result<void> build_scenes(hiprtContext context, hiprtBuildOperation operation, SceneInputs inputs,
                          const hiprtBuildOptions& options, void* temporary, hipStream_t stream,
                          const hiprtScene* scenes) {
  if (operation != hiprtBuildOperationBuild && operation != hiprtBuildOperationUpdate) return {};
  Scratch scratch(temporary, stream);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const Found found = context->scenes.find(scenes[i]);
    if (!found) return gpu::fail(ErrorCode::kInvalidInput, "scene ", i, " is none of this context");
    SceneBuild build(inputs[i], options, scratch, stream, found);
    if (auto built = build.run(context->host_buffers); !built) return built;
  }
  return {};
}

}  // namespace hiprt::api
