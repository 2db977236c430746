#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/instances.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/instances/gpu_instance_kernels.h>
#include <hiprt_build/instances/gpu_instance_layout.h>
#include <hiprt_build/instances/gpu_motion_kernels.h>
#include <hiprt_build/instances/gpu_update_kernels.h>
#include <hiprt_build/pipeline/gpu_build_plan.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::InstanceBounds;

/// Needed until the stream has passed the build or the update.
struct InstanceScratch {
  SharedNeeds* needs;
  Box* boxes;
  std::byte* tree;  ///< Of the build.
  // Of the update, in the same memory.
  build::GeometryView* geometry;
  build::OuterPlanes* outer;
  std::uint32_t* parents;

  InstanceScratch(Arena& arena, std::uint32_t instances, std::uint64_t tree_bytes)
      : needs(arena.take<SharedNeeds>(1)), boxes(arena.take<Box>(std::max(1u, instances))) {
    Arena update = arena;
    tree = arena.take<std::byte>(tree_bytes);
    geometry = update.take<build::GeometryView>(1);
    outer = update.take<build::OuterPlanes>(1);
    parents = update.take<std::uint32_t>(std::max(1u, instances));
    arena.skip(update);
  }
};

/// What of the options is not the caller's.
BuildOptions tree_options(const SceneObjects& objects, const InstanceOptions& options) {
  BuildOptions tree = options.tree;
  tree.nodes = objects.layout;
  tree.max_leaf_triangles = 1;
  tree.pair_triangles = false;
  return tree;
}

/// @param boxes nullptr: for sizes.
DeviceGeometry tree_geometry(std::uint32_t instances, const Box* boxes) {
  static const Box none{};
  return {.boxes = boxes != nullptr ? boxes : &none, .primitive_count = instances};
}

/// All numbers of a build.
struct InstanceLayouts {
  BuildSizes tree;
  InstanceOutputLayout places;
  BuildSizes sizes;
};

Result<InstanceLayouts> plan_instances(const SceneObjects& objects, std::uint32_t instances,
                                       const InstanceOptions& options, std::uint32_t key_count) {
  if (key_count > kMaxBuildPrimitives)
    return fail(ErrorCode::kTooLarge, key_count, " keys of motions, the limit is ", kMaxBuildPrimitives);
  if (options.bounds == InstanceBounds::kPrimitives)
    return fail(ErrorCode::kInvalidInput,
                "bounds of instances are made on the device of roots, children and grandchildren, not of primitives");
  if (options.bounds > InstanceBounds::kPrimitives)
    return fail(ErrorCode::kInvalidInput, "bounds is ", static_cast<unsigned>(options.bounds),
                ", which is none of build::InstanceBounds");
  if (options.tree.progress) return fail(ErrorCode::kInvalidInput, "builds over instances do not ask whether to go on");
  const DeviceGeometry geometry = tree_geometry(instances, nullptr);
  const auto tree = build_sizes({&geometry, 1}, tree_options(objects, options));
  if (!tree) return tl::unexpected(tree.error());
  Arena arena;
  InstanceScratch(arena, instances, tree->scratch);
  const InstanceOutputLayout places(tree->output, instances, key_count, objects.count);
  return InstanceLayouts{*tree, places, {places.size, arena.size()}};
}

/// The plan, and a check of the memory. @param function for messages.
Result<InstanceLayouts> checked_plan(const char* function, const SceneObjects& objects,
                                     const DeviceInstances& instances, const InstanceOptions& options,
                                     const std::byte* output, const std::byte* scratch) {
  auto layouts = plan_instances(objects, instances.count, options, instances.motions.key_count);
  if (!layouts) return layouts;
  for (const std::byte* memory : {output, scratch})
    if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % kDeviceAlignment != 0)
      return fail(ErrorCode::kInvalidInput, function, ": output and scratch must be aligned to ", kDeviceAlignment,
                  " bytes");
  if (instances.instances == nullptr && instances.count != 0)
    return fail(ErrorCode::kInvalidInput, function, ": ", instances.count, " instances at nullptr");
  const DeviceMotions& motions = instances.motions;
  if ((motions.ranges != nullptr) != (motions.key_count != 0) ||
      (motions.ranges != nullptr && (motions.keys != nullptr) == (motions.matrices != nullptr)))
    return fail(ErrorCode::kInvalidInput, function, ": motions need ranges, a key_count, and either keys or matrices");
  if (motions.ranges != nullptr && (motions.kind < MotionKind::kSlerp || motions.kind > MotionKind::kMatrix))
    return fail(ErrorCode::kInvalidInput, function, ": motions of unknown kind ", static_cast<unsigned>(motions.kind));
  if (objects.base == nullptr) return layouts;
  const auto begin = reinterpret_cast<std::uintptr_t>(output), base = reinterpret_cast<std::uintptr_t>(objects.base);
  if (base < begin || base - begin < layouts->sizes.output)
    return fail(ErrorCode::kInvalidInput, function, ": the output needs ", layouts->sizes.output,
                " bytes before the objects, there are ", base < begin ? std::uintptr_t{0} : base - begin);
  return layouts;
}

/// Where the scene's own arrays are in the output.
struct InstanceOutput {
  InstanceRecord* records;
  MotionRecord* motions;  ///< nullptr: nothing moves.
  MotionSegment* segments;
  std::uint64_t segments_offset;
  ObjectRecord* objects;
  InstanceReport* report;

  InstanceOutput(std::byte* output, const InstanceOutputLayout& places, std::uint32_t key_count)
      : records(reinterpret_cast<InstanceRecord*>(output + places.records)),
        motions(key_count == 0 ? nullptr : reinterpret_cast<MotionRecord*>(output + places.motions)),
        segments(reinterpret_cast<MotionSegment*>(output + places.segments)),
        segments_offset(places.segments),
        objects(reinterpret_cast<ObjectRecord*>(output + places.objects)),
        report(reinterpret_cast<InstanceReport*>(output + places.report)) {}
};

/// Records and boxes.
void enqueue_records(Launcher& steps, const SceneObjects& objects, const DeviceInstances& instances,
                     const InstanceOptions& options, const InstanceOutput& out, const InstanceScratch& memory) {
  steps.one("start_instances", start_instances, memory.needs);
  if (instances.count == 0) return;
  const auto levels = static_cast<unsigned>(options.bounds);
  dispatch_layout(objects.layout, [&](auto layout) {
    using Layout = decltype(layout);
    const std::uint32_t blocks = (instances.count - 1) / kInstanceBlock + 1;
    const MakeInstanceStep<Layout> step{instances.instances, instances.count, instances.motions.ranges, objects, levels,
                                        out.records,         memory.boxes};
    steps.blocks("make_instances", kInstanceBlock, blocks, make_instances<Layout>, step, memory.needs);
    if (out.motions == nullptr) return;
    const MoveInstanceStep<Layout> move{step, instances.motions, out.motions, out.segments, out.segments_offset};
    steps.blocks("move_instances", kInstanceBlock, blocks, move_instances<Layout>, move, memory.needs);
  });
}

}  // namespace

SceneObjects objects_in(const BufferView& view) {
  return {nullptr,
          nullptr,
          static_cast<std::uint32_t>(view.objects.size()),
          view.layout(),
          view.header->shutter_begin,
          view.header->shutter_rate};
}

SceneObjects objects_of(const DeviceScene& scene, const BufferView& view) {
  SceneObjects objects = objects_in(view);
  objects.base = scene.view.base;
  objects.records = scene.view.objects;
  return objects;
}

Result<BuildSizes> instance_sizes(const SceneObjects& objects, std::uint32_t instances, const InstanceOptions& options,
                                  std::uint32_t key_count) {
  const auto layouts = plan_instances(objects, instances, options, key_count);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes;
}

namespace {

/// A build or an update: what both do.
class InstanceBuild {
 public:
  InstanceBuild(const SceneObjects& objects, const DeviceInstances& instances, const InstanceOptions& options,
                const InstanceLayouts& layouts, std::byte* output, std::byte* scratch, hipStream_t stream)
      : objects_(objects),
        instances_(instances),
        options_(options),
        output_(output),
        arena_(scratch),
        memory_(arena_, instances.count, layouts.tree.scratch),
        out_(output, layouts.places, instances.motions.key_count),
        size_(layouts.places.size),
        file_(output_tree_layout(objects.layout, instances.count)),
        steps_(stream) {}

  Result<const InstanceReport*> build() {
    enqueue_records(steps_, objects_, instances_, options_, out_, memory_);
    const BuildReport* built = nullptr;
    steps_.then([&]() -> Result<void> {
      const DeviceGeometry geometry = tree_geometry(instances_.count, memory_.boxes);
      auto tree =
          enqueue_build({&geometry, 1}, tree_options(objects_, options_), output_, memory_.tree, steps_.stream());
      if (!tree) return tl::unexpected(std::move(tree.error()));
      built = *tree;
      return {};
    });
    return finish(built);
  }

  /// @param report offset of the build's report in the output.
  Result<const InstanceReport*> update(std::uint64_t report) {
    enqueue_records(steps_, objects_, instances_, options_, out_, memory_);
    auto* built = reinterpret_cast<BuildReport*>(output_ + report);
    steps_.one("put_boxes", put_boxes,
               build::GeometryView::of_boxes(memory_.boxes, instances_.count, sizeof(Box), sizeof(float[3]), 0),
               memory_.geometry);
    dispatch_layout(objects_.layout, [&](auto layout) { move<decltype(layout)>(built); });
    return finish(built);
  }

 private:
  template <class T> T* section(TreeSection i) const { return reinterpret_cast<T*>(output_ + file_[i].offset); }

  template <class Layout> void move(BuildReport* built) {
    const build::RefitFile<Layout> file{
        reinterpret_cast<FileHeader*>(output_),
        NodeArray<typename Layout::Node>(output_ + file_[kNodesAt].offset, NodePlaces(file_[kNodesAt], Layout::kId)),
        section<typename Layout::Leaf>(kLeavesAt),
        file_[kNodesAt].offset,
        file_[kLeavesAt].offset,
        memory_.geometry,
        memory_.parents,
        memory_.outer};
    const UpdatePlan<Layout> plan{file, built, section<std::uint32_t>(kPrimitiveMapAt)};
    const std::uint32_t count = std::max(1u, instances_.count);
    steps_.each(count, "begin_update", begin_update<Layout>, plan, memory_.boxes, instances_.count, memory_.needs);
    steps_.each(count, "link_up", update_each<build::LinkUpStep<Layout>>, {file}, built, false);
    steps_.each(count, "move_leaves", update_each<build::MoveLeafStep<Layout>>, {file}, built, true);
    steps_.each(count, "refit_nodes", update_each<build::RefitNodeStep<Layout>>, {file}, built, false);
    steps_.one("finish_update", finish_update<Layout>, plan);
  }

  Result<const InstanceReport*> finish(const BuildReport* built) {
    const InstancePlan plan{output_,      built,        instances_,   objects_,    section<CustomLeaf>(kLeavesAt),
                            out_.records, out_.motions, out_.objects, out_.report, size_};
    steps_.each(std::max({1u, instances_.count, objects_.count}), "finish_instances", finish_instances, plan,
                memory_.needs);
    if (!steps_.result()) return tl::unexpected(std::move(steps_.result().error()));
    return out_.report;
  }

  const SceneObjects& objects_;
  const DeviceInstances& instances_;
  const InstanceOptions& options_;
  std::byte* output_;
  Arena arena_;
  InstanceScratch memory_;
  InstanceOutput out_;
  std::uint64_t size_;
  FileLayout file_;
  Launcher steps_;
};

}  // namespace

Result<const InstanceReport*> enqueue_instances(const SceneObjects& objects, const DeviceInstances& instances,
                                                const InstanceOptions& options, std::byte* output, std::byte* scratch,
                                                hipStream_t stream) {
  const auto layouts = checked_plan("enqueue_instances", objects, instances, options, output, scratch);
  if (!layouts) return tl::unexpected(layouts.error());
  return InstanceBuild(objects, instances, options, *layouts, output, scratch, stream).build();
}

Result<const InstanceReport*> enqueue_update(const SceneObjects& objects, const DeviceInstances& instances,
                                             const InstanceOptions& options, std::byte* output, std::byte* scratch,
                                             hipStream_t stream) {
  const auto layouts = checked_plan("enqueue_update", objects, instances, options, output, scratch);
  if (!layouts) return tl::unexpected(layouts.error());
  const DeviceGeometry geometry = tree_geometry(instances.count, nullptr);
  const auto tree = plan_build({&geometry, 1}, tree_options(objects, options));
  if (!tree) return tl::unexpected(tree.error());
  return InstanceBuild(objects, instances, options, *layouts, output, scratch, stream).update(tree->report);
}

}  // namespace hiprt::gpu
