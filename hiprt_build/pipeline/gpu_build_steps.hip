#include <hiprt_build/gpu/build_steps.h>

#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/pipeline/gpu_build_job.h>
#include <hiprt_build/presplit/split_demand.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace hiprt::gpu {
namespace {

using build::Reference;
using build::kernels::BuildState;

enum class Step { kLeaves, kSplit, kTree, kFile, kDone };

/// What the outputs of all steps but the last begin with: one copy moves all of it.
struct Beginning {
  Head head;
  GeometryRecord* records;

  Beginning(Arena& arena, const BuildPlan& plan)
      : head(arena, plan), records(arena.take<GeometryRecord>(plan.geometries)) {}

  static std::uint64_t size(const BuildPlan& plan) {
    Arena arena;
    Beginning(arena, plan);
    return arena.size();
  }
};

/// Where everything is in a step.
struct Places {
  BuildMemory memory{};
  BuildOutput output{};
  BuildSizes sizes{};

  /// @param before of the step before. Without memory only the sizes are set.
  Places(Step step, const BuildPlan& plan, const FileLayout& file, const BuildMemory& before, std::byte* to,
         std::byte* scratch)
      : memory(before) {
    Arena kept(to), temporary(scratch);
    if (step == Step::kFile) {
      output.report = temporary.take<BuildReport>(1);
      output.file = file;
      sizes = {file.byte_size(), temporary.size()};
      if (to == nullptr) return;
      output.base = to;
      output.records = reinterpret_cast<GeometryRecord*>(to + file[kGeometriesAt].offset);
      return;
    }
    const Beginning beginning(kept, plan);
    memory.head = beginning.head;
    output.records = beginning.records;
    if (step == Step::kLeaves) {
      memory.references = kept.take<Reference>(plan.primitives);
      if (plan.pairs) memory.pairing = EdgeTableScratch::take(temporary, plan.primitives);
    } else if (step == Step::kSplit) {
      memory.gapped = GappedTree::take(kept, plan.slots);
      memory.scratch = TreeScratch(temporary, plan, {}, true, false);
    } else {
      memory.tree = TreeMemory(kept, plan);
      memory.scratch = TreeScratch(temporary, plan, memory.tree, !plan.gapped(), true);
    }
    sizes = {kept.size(), temporary.size()};
  }
};

Result<void> copy(void* to, const void* from, std::size_t bytes, hipMemcpyKind kind, hipStream_t stream) {
  if (bytes == 0) return {};
  return check(hipMemcpyAsync(to, from, bytes, kind, stream), "hipMemcpyAsync", bytes, " bytes");
}

/// Waits.
template <class T> Result<T> read(const T* from, hipStream_t stream) {
  T value;
  auto done = copy(&value, from, sizeof(T), hipMemcpyDeviceToHost, stream);
  if (done) done = check(hipStreamSynchronize(stream), "hipStreamSynchronize");
  if (!done) return tl::unexpected(std::move(done.error()));
  return value;
}

}  // namespace

struct BuildSteps::State {
  std::vector<DeviceGeometry> geometries;
  BuildOptions options;
  BuildPlan plan;
  FileLayout file{};
  Step step = Step::kLeaves;
  bool started = false, failed = false;
  hipStream_t stream = nullptr;
  BuildMemory memory{};  ///< Of the step before; of this one, once it is started.
  BuildOutput output{};
  BuildReport report{};

  Places places(std::byte* to, std::byte* scratch) const { return {step, plan, file, memory, to, scratch}; }

  Result<void> start(std::byte* to, std::byte* scratch) {
    const Places now = places(to, scratch);
    const BuildJob job{plan, options, geometries, now.memory, now.output};
    Result<void> done{};
    if (step == Step::kLeaves) {
      done = enqueue_leaves(job, stream);
    } else if (step != Step::kFile) {
      done = copy(now.memory.head.state, memory.head.state, Beginning::size(plan), hipMemcpyDeviceToDevice, stream);
      if (done && (step == Step::kSplit || !plan.gapped())) done = enqueue_split(job, stream);
      if (done && step == Step::kTree) done = enqueue_tree(job, stream);
    } else {
      done = clear_gaps(now.output.base, file, plan.layout, stream);
      if (done)
        done = copy(now.output.records, output.records, plan.geometries * sizeof(GeometryRecord),
                    hipMemcpyDeviceToDevice, stream);
      if (done) done = enqueue_file(job, stream);
    }
    memory = now.memory;
    output = now.output;
    return done;
  }

  /// What the device has counted becomes the capacity of the next step.
  Result<void> finish() {
    if (step == Step::kFile) {
      const auto read_report = read<BuildReport>(output.report, stream);
      if (!read_report) return tl::unexpected(read_report.error());
      report = *read_report;
      if (auto usable = check_report(report); !usable) return usable;
      step = Step::kDone;
      return {};
    }
    const auto state = read<BuildState>(memory.head.state, stream);
    if (!state) return tl::unexpected(state.error());
    const std::uint32_t leaves = state->counts.leaves;
    if (step == Step::kLeaves) {
      if (plan.measures_demand)
        plan.split_budget = build::split_budget_for(
            state->demand, plan.split_budget, static_cast<double>(build::kMaxPlannedNodes) / std::max(leaves, 1u));
      return plan_split(leaves);
    }
    if (step == Step::kTree) return plan_file(state->nodes, leaves);
    // Nothing has a size of 0.
    plan.capacity = std::max(leaves, 1u);
    step = Step::kTree;
    return {};
  }

  Result<void> plan_split(std::uint32_t leaves) {
    if (auto planned = plan_leaves(plan, std::max(leaves, 1u), true); !planned) return planned;
    if (plan.capacity > build::kMaxPlannedNodes)
      return fail(ErrorCode::kTooLarge, leaves, " leaves may become ", plan.capacity, " by splits, the limit is ",
                  build::kMaxPlannedNodes, ". A smaller split_budget or presplit_budget makes fewer");
    step = plan.gapped() ? Step::kSplit : Step::kTree;
    return {};
  }

  Result<void> plan_file(std::uint32_t nodes, std::uint32_t leaves) {
    plan.wide = std::max(nodes, 1u);
    file = tree_layout(plan.layout, {nodes, leaves, plan.primitives, plan.geometries});
    if (file[kPrimitiveMapAt].offset > kAddressLimit)
      return fail(ErrorCode::kTooLarge, nodes, " nodes and ", leaves, " leaves end at byte ",
                  file[kPrimitiveMapAt].offset, ", a node reference addresses ", kAddressLimit);
    step = Step::kFile;
    return {};
  }
};

BuildSteps::BuildSteps(std::unique_ptr<State> state) : state_(std::move(state)) {}
BuildSteps::BuildSteps(BuildSteps&&) noexcept = default;
BuildSteps& BuildSteps::operator=(BuildSteps&&) noexcept = default;
BuildSteps::~BuildSteps() = default;

Result<BuildSteps> BuildSteps::make(std::span<const DeviceGeometry> geometries, const BuildOptions& options) {
  auto plan = plan_memory(geometries, options);
  if (!plan) return tl::unexpected(plan.error());
  plan->measures_demand = build::splits_as_needed(options) && plan->split_budget > 1.0;
  return BuildSteps(std::make_unique<State>(State{{geometries.begin(), geometries.end()}, options, *plan}));
}

BuildSizes BuildSteps::sizes() const { return state_->places(nullptr, nullptr).sizes; }

Result<void> BuildSteps::enqueue(std::byte* output, std::byte* scratch, hipStream_t stream) {
  State& state = *state_;
  if (state.failed || state.started || done())
    return fail(ErrorCode::kInvalidInput, "BuildSteps::enqueue: ",
                done()         ? "no step is left"
                : state.failed ? "an earlier step has failed"
                               : "wait() for the step that was started");
  const BuildSizes needed = sizes();
  if (auto memory = check_memory("BuildSteps::enqueue", {output}); !memory) return memory;
  if (needed.scratch != 0)
    if (auto memory = check_memory("BuildSteps::enqueue", {scratch}); !memory) return memory;
  state.stream = stream;
  state.started = true;
  auto started = state.start(output, scratch);
  state.failed = !started;
  return started;
}

Result<void> BuildSteps::wait() {
  State& state = *state_;
  if (!state.started || state.failed)
    return fail(ErrorCode::kInvalidInput, "BuildSteps::wait: no step was started, or one has failed");
  auto done = state.finish();
  state.failed = !done;
  state.started = false;
  return done;
}

bool BuildSteps::done() const { return state_->step == Step::kDone; }

const BuildReport& BuildSteps::report() const { return state_->report; }

Result<BuiltScene> build_scene(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                               hipStream_t stream, Allocator& allocator) {
  auto steps = BuildSteps::make(geometries, options);
  if (!steps) return tl::unexpected(std::move(steps.error()));
  DeviceBuffer scene;
  while (!steps->done()) {
    const BuildSizes sizes = steps->sizes();
    auto output = DeviceBuffer::make(sizes.output, stream, allocator);
    if (!output) return tl::unexpected(std::move(output.error()));
    auto scratch = DeviceBuffer::make(sizes.scratch, stream, allocator);
    if (!scratch) return tl::unexpected(std::move(scratch.error()));
    auto done = steps->enqueue(output->data(), scratch->data(), stream);
    if (done) done = steps->wait();
    if (!done) return tl::unexpected(std::move(done.error()));
    scene = std::move(*output);
  }
  const BuildReport& report = steps->report();
  if (report.status == BuildStatus::kBadIndex)
    return fail(ErrorCode::kInvalidInput, report.bad_indices, " triangles have an index beyond their mesh's positions");
  return BuiltScene{std::move(scene), report.view, report};
}

}  // namespace hiprt::gpu
