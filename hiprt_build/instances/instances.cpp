#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>

#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/instance_group.h>

#include <algorithm>
#include <cstring>
#include <tuple>

namespace hiprt::build {
namespace {

std::uint64_t align(std::uint64_t offset, std::uint64_t to) { return (offset + to - 1) / to * to; }

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

/// Where a tree's sections begin, the first of them.
std::size_t first_section(const BufferView& tree) {
  std::uint64_t first = tree.bytes.size();
  for (const SectionEntry* section : {&tree.nodes, &tree.leaves, &tree.primitive_map_entry, &tree.geometry_entry})
    first = std::min(first, section->offset);
  return static_cast<std::size_t>(first);
}

/// How far they have to move for a table of that many more entries.
std::uint64_t room_wanted(const BufferView& tree, unsigned entries) {
  const std::uint64_t table_end =
      sizeof(FileHeader) + (std::uint64_t{tree.header->section_count} + entries) * sizeof(SectionEntry);
  const std::uint64_t first = first_section(tree);
  return table_end <= first ? 0 : align(table_end - first, kSectionAlignment);
}

/// A reference to what lies @p by bytes farther back.
NodeRef moved(NodeRef ref, std::uint64_t by) { return make_ref(ref_offset(ref) + by, ref_type(ref)); }

/// Leaves, map and counts of a tree over parts, as those of one over instances.
void name_instances(std::byte* bytes, const InstanceGroup& group, std::span<SectionEntry> sections) {
  const auto section = [&](SectionKind kind) -> SectionEntry& {
    return *std::find_if(sections.begin(), sections.end(),
                         [&](const SectionEntry& entry) { return entry.kind == static_cast<std::uint32_t>(kind); });
  };
  SectionEntry& map_section = section(SectionKind::kPrimitiveMap);
  const SectionEntry &leaf_section = section(SectionKind::kLeaves),
                     &geometry_section = section(SectionKind::kGeometries);
  const std::span leaves(reinterpret_cast<CustomLeaf*>(bytes + leaf_section.offset),
                         static_cast<std::size_t>(leaf_section.count));
  for (CustomLeaf& leaf : leaves) {
    const std::size_t number = leaf.info.primitive[0];
    const InstancePart& part = group.parts[number];
    if (!group.moving_boxes.empty()) std::tie(leaf.box[0], leaf.box[1]) = group.moving_boxes[number];
    leaf.info.primitive[0] = part.instance;
    leaf.info.primitive[1] = part.ref;
  }
  if (group.parts.size() == group.records.size()) return;
  const std::span map(reinterpret_cast<std::uint32_t*>(bytes + map_section.offset), group.parts.size());
  std::vector<std::uint32_t> by_instance(group.records.size(), kInvalidId);
  for (std::size_t i = 0; i < map.size(); ++i) {
    std::uint32_t& leaf = by_instance[group.parts[i].instance];
    if (leaf == kInvalidId) leaf = map[i];
  }
  std::fill(map.begin(), map.end(), 0u);
  std::copy(by_instance.begin(), by_instance.end(), map.begin());
  map_section.count = by_instance.size();
  reinterpret_cast<GeometryRecord*>(bytes + geometry_section.offset)->primitive_count = by_instance.size();
  reinterpret_cast<FileHeader*>(bytes)->primitive_count = by_instance.size();
}

/// Of each object where its shapes are; empty if none has any.
std::vector<std::uint64_t> shapes_of(std::span<const ObjectParts> objects) {
  std::vector<std::uint64_t> result;
  for (const ObjectParts& object : objects) result.push_back(object.view.shape_entry.offset);
  if (std::all_of(result.begin(), result.end(), [](std::uint64_t offset) { return offset == 0; })) result.clear();
  return result;
}

/// The file of a tree over instances' boxes, with the instances, and for the scene all objects.
/// @param group whose motions get their segments' place.
/// @param all_objects of the scene's file; else none.
Buffer finish_file(const BufferView& tree, InstanceGroup& group, const std::optional<Shutter>& shutter,
                   std::span<const ObjectParts> all_objects) {
  const FileHeader& from = *tree.header;
  const std::vector<std::uint64_t> shapes = shapes_of(all_objects);
  const unsigned more = 1 + (group.motions.empty() ? 0 : 2) + (all_objects.empty() ? 0 : 2) + (shapes.empty() ? 0 : 1);
  const std::uint64_t shift = room_wanted(tree, more);
  const auto* table = reinterpret_cast<const SectionEntry*>(tree.bytes.data() + sizeof(FileHeader));
  std::vector<SectionEntry> sections(table, table + from.section_count);
  for (SectionEntry& section : sections) section.offset += shift;
  std::uint64_t end = tree.bytes.size() + shift;
  const auto add = [&](SectionKind kind, std::uint64_t alignment, std::uint64_t count, std::uint64_t stride,
                       std::uint32_t flags = kSectionRequired) {
    sections.push_back({static_cast<std::uint32_t>(kind), flags, align(end, alignment), count, stride});
    end = sections.back().offset + count * stride;
    return sections.back().offset;
  };
  const std::uint64_t instances =
      add(SectionKind::kInstances, kSectionAlignment, group.records.size(), sizeof(InstanceRecord));
  std::uint64_t motions = 0, segments = 0;
  if (!group.motions.empty()) {
    motions = add(SectionKind::kMotions, kSectionAlignment, group.motions.size(), sizeof(MotionRecord));
    segments = add(SectionKind::kMotionSegments, kSectionAlignment, group.segments.size(), sizeof(MotionSegment));
    for (MotionRecord& motion : group.motions)
      if (motion.count != 0) motion.segments += segments;
  }
  std::vector<ObjectRecord> objects;
  std::uint64_t object_table = 0, object_shapes = 0;
  if (!shapes.empty())
    object_shapes = add(SectionKind::kObjectShapes, kSectionAlignment, shapes.size(), sizeof(std::uint64_t), 0);
  if (!all_objects.empty()) {
    object_table = add(SectionKind::kObjects, kSectionAlignment, all_objects.size(), sizeof(ObjectRecord));
    std::uint64_t files_end = align(end, kBufferAlignment);
    const std::uint64_t files_begin = files_end;
    for (const ObjectParts& object : all_objects) {
      objects.push_back(object.record);
      objects.back().offset = align(files_end, kBufferAlignment);
      files_end = objects.back().offset + object.record.size;
    }
    add(SectionKind::kObjectFiles, kBufferAlignment, files_end - files_begin, 1);
  }
  Buffer buffer(end);
  std::byte* bytes = buffer.bytes().data();
  std::memcpy(bytes, tree.bytes.data(), sizeof(FileHeader));
  const std::size_t first = first_section(tree);
  std::memcpy(bytes + first + shift, tree.bytes.data() + first, tree.bytes.size() - first);
  name_instances(bytes, group, sections);
  std::memcpy(bytes + sizeof(FileHeader), sections.data(), sections.size() * sizeof(SectionEntry));
  const auto put = [&](std::uint64_t at, const auto& records) {
    const auto raw = std::as_bytes(std::span(records));
    std::copy(raw.begin(), raw.end(), bytes + at);
  };
  put(instances, group.records);
  put(motions, group.motions);
  put(segments, group.segments);
  put(object_table, objects);
  put(object_shapes, shapes);
  for (std::size_t i = 0; i < objects.size(); ++i)
    std::memcpy(bytes + objects[i].offset, all_objects[i].view.bytes.data(), objects[i].size);
  auto& header = *reinterpret_cast<FileHeader*>(bytes);
  header.features = group.needs.features;
  header.byte_size = end;
  header.section_count = static_cast<std::uint32_t>(sections.size());
  header.stack_bound += group.needs.stack;
  header.levels = group.needs.levels;
  if (header.root != kInvalidRef) header.root = moved(header.root, shift);
  if (shift != 0)
    dispatch_layout(tree.layout(), [&](auto layout) {
      using Node = typename decltype(layout)::Node;
      auto* nodes = reinterpret_cast<Node*>(bytes + tree.nodes.offset + shift);
      for (std::size_t i = 0; i < tree.nodes.count; ++i)
        for (NodeRef& child : nodes[i].child)
          if (child != kInvalidRef) child = moved(child, shift);
    });
  header.condition = affine_detail::round_up(group.needs.condition);
  header.reach = affine_detail::round_up(group.needs.reach);
  if (shutter) {
    header.shutter_begin = shutter->begin;
    header.shutter_rate = shutter->rate;
  }
  header.checksum = file_checksum(buffer.bytes());
  return buffer;
}

/// What is told of the groups' builds: each is a part of the whole.
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
      auto group = prepare_instances(engine_, scene_.groups[g], before, options_, shutter, g);
      if (!group) return tl::unexpected(std::move(group.error()));
      auto tree = build_tree(group->boxes, g);
      if (!tree) return tl::unexpected(std::move(tree.error()));
      Buffer file = finish_file(*open_buffer(tree->buffer.bytes()), *group, shutter,
                                last ? before : std::span<const ObjectParts>{});
      const std::uint32_t stack = reinterpret_cast<const FileHeader*>(file.bytes().data())->stack_bound;
      if (stack > kMaxInstancedStack)
        return tl::unexpected(Error{ErrorCode::kTooLarge, "group " + std::to_string(g) + " needs " +
                                                              std::to_string(stack) + " stack entries, the limit is " +
                                                              std::to_string(kMaxInstancedStack)});
      tree->buffer = std::move(file);
      if (last) return std::move(*tree);
      objects_.emplace_back(*open_buffer(tree->buffer.bytes()));
      groups_.push_back(std::move(tree->buffer));
    }
  }

 private:
  /// 4096 levels of instances, or trees whose boxes lie in each other.
  static constexpr std::uint32_t kMaxInstancedStack = 1u << 16;

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

}  // namespace

Result<Bvh> build_instances(const InstancedScene& scene, const InstanceOptions& options) {
  if (!(options.opening_budget >= 1.0 && options.opening_budget <= 64.0))
    return tl::unexpected(invalid("opening_budget is " + text(options.opening_budget) + ", 1 to 64 expected"));
  if (scene.groups.empty()) return tl::unexpected(invalid("a scene of instances has a group at least"));
  auto objects = open_files(scene.files);
  if (!objects) return tl::unexpected(std::move(objects.error()));
  SceneProgress progress(options.tree.progress, scene.groups.size());
  return run_cpu("scene", scene.groups.size(), options.tree.threads, progress.of_bounds(), [&](CpuEngine& engine) {
    return SceneBuilder(engine, scene, options, std::move(*objects), progress).run();
  });
}

Result<Bvh> build_instances(std::span<const std::span<const std::byte>> files, std::span<const Instance> instances,
                            const InstanceOptions& options) {
  const std::span<const Instance> groups[1] = {instances};
  return build_instances(InstancedScene{files, groups}, options);
}

}  // namespace hiprt::build
