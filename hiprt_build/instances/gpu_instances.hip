#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/instances.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/instances/gpu_instance_kernels.h>
#include <hiprt_build/instances/gpu_instance_layout.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::InstanceBounds;

/// Needed until the stream has passed the build.
struct InstanceScratch {
  SharedNeeds* needs;
  Box* boxes;
  std::byte* tree;

  InstanceScratch(Arena& arena, std::uint32_t instances, std::uint64_t tree_bytes)
      : needs(arena.take<SharedNeeds>(1)),
        boxes(arena.take<Box>(std::max(1u, instances))),
        tree(arena.take<std::byte>(tree_bytes)) {}
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
                                       const InstanceOptions& options) {
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
  const InstanceOutputLayout places(tree->output, instances, objects.count);
  return InstanceLayouts{*tree, places, {places.size, arena.size()}};
}

Result<void> check_memory(const SceneObjects& objects, const DeviceInstances& instances, const InstanceLayouts& layouts,
                          const std::byte* output, const std::byte* scratch) {
  for (const std::byte* memory : {output, scratch})
    if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % kDeviceAlignment != 0)
      return fail(ErrorCode::kInvalidInput, "enqueue_instances: output and scratch must be aligned to ",
                  kDeviceAlignment, " bytes");
  if (instances.instances == nullptr && instances.count != 0)
    return fail(ErrorCode::kInvalidInput, "enqueue_instances: ", instances.count, " instances at nullptr");
  const auto begin = reinterpret_cast<std::uintptr_t>(output), base = reinterpret_cast<std::uintptr_t>(objects.base);
  if (base < begin || base - begin < layouts.sizes.output)
    return fail(ErrorCode::kInvalidInput, "enqueue_instances: the output needs ", layouts.sizes.output,
                " bytes before the objects, there are ", base < begin ? std::uintptr_t{0} : base - begin);
  return {};
}

/// Records and boxes.
void enqueue_records(Launcher& steps, const SceneObjects& objects, const DeviceInstances& instances,
                     const InstanceOptions& options, InstanceRecord* records, const InstanceScratch& memory) {
  if (instances.count == 0) return;
  const auto levels = static_cast<unsigned>(options.bounds);
  dispatch_layout(objects.layout, [&](auto layout) {
    using Layout = decltype(layout);
    const MakeInstanceStep<Layout> step{instances.instances, instances.count, objects, levels, records, memory.boxes};
    steps.blocks("make_instances", kInstanceBlock, (instances.count - 1) / kInstanceBlock + 1, make_instances<Layout>,
                 step, memory.needs);
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

Result<BuildSizes> instance_sizes(const SceneObjects& objects, std::uint32_t instances,
                                  const InstanceOptions& options) {
  const auto layouts = plan_instances(objects, instances, options);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes;
}

Result<const InstanceReport*> enqueue_instances(const SceneObjects& objects, const DeviceInstances& instances,
                                                const InstanceOptions& options, std::byte* output, std::byte* scratch,
                                                hipStream_t stream) {
  const auto layouts = plan_instances(objects, instances.count, options);
  if (!layouts) return tl::unexpected(layouts.error());
  if (auto good = check_memory(objects, instances, *layouts, output, scratch); !good)
    return tl::unexpected(std::move(good.error()));
  Arena arena(scratch);
  const InstanceScratch memory(arena, instances.count, layouts->tree.scratch);
  auto* records = reinterpret_cast<InstanceRecord*>(output + layouts->places.records);
  auto* report = reinterpret_cast<InstanceReport*>(output + layouts->places.report);
  Launcher steps(stream);
  steps.one("start_instances", start_instances, memory.needs);
  enqueue_records(steps, objects, instances, options, records, memory);
  const BuildReport* built = nullptr;
  steps.then([&]() -> Result<void> {
    const DeviceGeometry geometry = tree_geometry(instances.count, memory.boxes);
    auto tree = enqueue_build({&geometry, 1}, tree_options(objects, options), output, memory.tree, stream);
    if (!tree) return tl::unexpected(std::move(tree.error()));
    built = *tree;
    return {};
  });
  const FileLayout file = output_tree_layout(objects.layout, instances.count);
  const InstancePlan plan{output,
                          built,
                          instances,
                          objects,
                          reinterpret_cast<CustomLeaf*>(output + file[kLeavesAt].offset),
                          records,
                          reinterpret_cast<ObjectRecord*>(output + layouts->places.objects),
                          report};
  steps.each(std::max({1u, instances.count, objects.count}), "finish_instances", finish_instances, plan, memory.needs);
  if (!steps.result()) return tl::unexpected(std::move(steps.result().error()));
  return report;
}

}  // namespace hiprt::gpu
