#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>

#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/instance_file.h>
#include <hiprt_build/instances/open_instances.h>

namespace hiprt::build {
namespace {

/// Of all files the layout, and no instances in them.
Result<std::vector<ObjectParts>> open_files(std::span<const std::span<const std::byte>> files) {
  std::vector<ObjectParts> objects;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string where = "file " + std::to_string(i) + ": ";
    const auto view = open_buffer(files[i]);
    if (!view) return tl::unexpected(invalid(where + to_string(view.error())));
    if (view->has_instances())
      return tl::unexpected(invalid(where + "has instances itself: give its objects and groups in place of it"));
    if (!objects.empty() && view->layout() != objects[0].view.layout())
      return tl::unexpected(invalid(where + "layout " + std::to_string(view->header->layout) + ", that of file 0 is " +
                                    std::to_string(objects[0].view.header->layout)));
    objects.emplace_back(*view);
  }
  return objects;
}

/// Progress of the whole scene from that of its groups' builds.
class SceneProgress {
 public:
  SceneProgress(const ProgressCallback& callback, std::size_t groups) : callback_(callback), groups_(groups) {}

  /// Of the builder of group @p g's tree.
  ProgressCallback of_tree(std::size_t g) {
    if (!callback_) return {};
    return [this, g](const Progress& progress) {
      done_ = (static_cast<double>(g) + progress.fraction) / static_cast<double>(groups_);
      return callback_({progress.step, done_});
    };
  }
  /// Between those.
  ProgressCallback of_bounds() {
    if (!callback_) return {};
    return [this](const Progress&) { return callback_({"bounds", done_}); };
  }

 private:
  const ProgressCallback& callback_;
  std::size_t groups_;
  double done_ = 0.0;
};

/// Builds the groups, one after the other.
class SceneBuilder {
 public:
  SceneBuilder(CpuEngine& engine, const InstancedScene& scene, const InstanceOptions& options,
               std::vector<ObjectParts> objects, SceneProgress& progress)
      : engine_(engine), scene_(scene), options_(options), objects_(std::move(objects)), progress_(progress) {}

  Result<Bvh> run() {
    const std::optional<Shutter> shutter = shutter_of(scene_.groups);
    for (std::size_t g = 0;; ++g) {
      const bool last = g + 1 == scene_.groups.size();
      const std::span<const ObjectParts> before(objects_);
      auto group = prepare_instances(engine_, scene_.groups[g], before, g);
      if (!group) return tl::unexpected(std::move(group.error()));
      if (auto made = make_parts(*group, shutter, g); !made) return tl::unexpected(std::move(made.error()));
      auto tree = build_tree(group->boxes, g);
      if (!tree) return tl::unexpected(std::move(tree.error()));
      Buffer file = write_instance_file(*open_buffer(tree->buffer.bytes()), *group, shutter,
                                        last ? before : std::span<const ObjectParts>{});
      const std::uint32_t stack = reinterpret_cast<const FileHeader*>(file.bytes().data())->stack_bound;
      if (stack > kMaxInstancedStack)
        return tl::unexpected(Error{ErrorCode::kTooLarge, "group " + std::to_string(g) + " needs " +
                                                              std::to_string(stack) + " stack entries, the limit is " +
                                                              std::to_string(kMaxInstancedStack)});
      tree->buffer = std::move(file);
      // Boxes of empty objects are not finite. All other instances have finite boxes.
      tree->statistics.dropped_degenerate += std::exchange(tree->statistics.dropped_not_finite, 0);
      if (last) return std::move(*tree);
      objects_.emplace_back(*open_buffer(tree->buffer.bytes()));
      groups_.push_back(std::move(tree->buffer));
    }
  }

 private:
  /// 4096 levels of instances, or trees whose boxes lie in each other.
  static constexpr std::uint32_t kMaxInstancedStack = 1u << 16;

  /// The parts of a group's instances, opened, with their boxes.
  Result<void> make_parts(InstanceGroup& group, const std::optional<Shutter>& shutter, std::size_t g) {
    PartBoxes boxes(group, objects_, options_.bounds);
    boxes.make(engine_);
    for (std::size_t i = 0; i < group.records.size(); ++i)
      if (group.parts[i].ref != kInvalidRef &&
          format_detail::first_bad_plane(group.boxes[i]) != format_detail::kNoPlane)
        return tl::unexpected(invalid("group " + std::to_string(g) + ", instance " + std::to_string(i) +
                                      ": its bounds are beyond what floats hold"));
    if (options_.opening_budget > 1.0) open_instances(engine_, boxes, options_.opening_budget, options_.open_largest);
    if (!shutter) return {};
    boxes.make_moving(engine_, *shutter);
    group.needs.features |= feature_bit(Feature::kMovingBoxes);
    return {};
  }

  Result<Bvh> build_tree(std::span<const Box> boxes, std::size_t g) {
    BuildOptions options = options_.tree;
    if (!objects_.empty()) options.nodes = objects_[0].view.layout();
    options.max_leaf_triangles = 1;
    options.pair_triangles = false;
    options.progress = progress_.of_tree(g);
    const CustomGeometry instances[1] = {{.boxes = boxes}};
    return build(SceneInput{{}, instances}, options);
  }

  CpuEngine& engine_;
  const InstancedScene& scene_;
  const InstanceOptions& options_;
  std::vector<ObjectParts> objects_;
  std::vector<Buffer> groups_;  ///< Of the objects that are groups.
  SceneProgress& progress_;
};

Result<Bvh> build_checked(const InstancedScene& scene, const InstanceOptions& options) {
  if (!(options.opening_budget >= 1.0 && options.opening_budget <= 64.0))
    return tl::unexpected(invalid("opening_budget is " + text(options.opening_budget) + ", 1 to 64 expected"));
  if (options.bounds > InstanceBounds::kPrimitives)
    return tl::unexpected(invalid("bounds is " + std::to_string(static_cast<unsigned>(options.bounds)) +
                                  ", which is none of InstanceBounds"));
  if (scene.groups.empty()) return tl::unexpected(invalid("a scene of instances has a group at least"));
  auto objects = open_files(scene.files);
  if (!objects) return tl::unexpected(std::move(objects.error()));
  SceneProgress progress(options.tree.progress, scene.groups.size());
  return run_cpu("scene", options.tree.threads, progress.of_bounds(), [&](CpuEngine& engine) {
    return SceneBuilder(engine, scene, options, std::move(*objects), progress).run();
  });
}

}  // namespace

Result<Bvh> build_instances(const InstancedScene& scene, const InstanceOptions& options) {
  return or_out_of_memory("for the scene", [&] { return build_checked(scene, options); });
}

Result<Bvh> build_instances(std::span<const std::span<const std::byte>> files, std::span<const Instance> instances,
                            const InstanceOptions& options) {
  const std::span<const Instance> groups[1] = {instances};
  return build_instances(InstancedScene{files, groups}, options);
}

}  // namespace hiprt::build
