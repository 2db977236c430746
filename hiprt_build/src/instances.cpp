#include <hiprt_build/instances.h>

#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/src/check_input.h>
#include <hiprt_build/src/motion_segments.h>
#include <hiprt_device/format/checksum.h>
#include <hiprt_device/format/instance_bounds.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <queue>

namespace hiprt::build {
namespace {

std::uint64_t align(std::uint64_t offset, std::uint64_t to) { return (offset + to - 1) / to * to; }

std::string place(std::size_t group, std::size_t instance) {
  return "group " + std::to_string(group) + ", instance " + std::to_string(instance) + ": ";
}

/// An object whose file stands.
struct ObjectParts {
  BufferView view;
  ObjectRecord record;

  explicit ObjectParts(const BufferView& of) : view(of), record(format_detail::describe(of)) {}
};

/// What a leaf is for.
struct InstancePart {
  std::uint32_t instance;
  NodeRef ref;         ///< Where rays enter the object; kInvalidRef: it is empty.
  unsigned depth = 0;  ///< Of that, below its root.
};

/// A group's instances on the way into its file.
struct Group {
  std::vector<InstanceRecord> records;
  /// None if no instance moves. Offsets of segments count from the first.
  std::vector<MotionRecord> motions;
  std::vector<MotionSegment> segments;
  std::vector<InstancePart> parts;
  std::vector<Box> boxes;  ///< Of the parts.
  format_detail::InstanceNeeds needs;

  std::span<const MotionSegment> motion_of(std::size_t i) const {
    if (motions.empty()) return {};
    return std::span(segments).subspan(static_cast<std::size_t>(motions[i].segments / sizeof(MotionSegment)),
                                       motions[i].count);
  }
};

/// The record of an instance, or what is wrong with its transform.
/// @param to_scene Instance::to_scene, or of one that moves the first place.
Result<InstanceRecord> make_record(const Instance& instance, const Affine& to_scene, std::size_t group, std::size_t i) {
  InstanceRecord record{};
  bool finite = true;
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 4; ++c) finite = finite && std::isfinite(to_scene.row[r][c]);
    std::copy_n(to_scene.row[r], 3, record.linear[r]);
    record.translation[r] = to_scene.row[r][3];
  }
  if (!finite) return tl::unexpected(invalid(place(group, i) + "the transform is not finite"));
  // In double, rounded once: the record's is what is traced, and all bounds are made of it.
  const LinearInverse inverse(record);
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) {
      record.linear[r][c] = static_cast<float>(inverse.row[r][c]);
      finite = finite && std::isfinite(record.linear[r][c]);
    }
  record.object = instance.object;
  record.mask = instance.mask;
  record.id = instance.id;
  record.flags = instance.without_filter ? InstanceFlags::kNoFilter : 0;
  const double condition = finite ? condition_of(record) : 0.0;
  const LinearInverse back(record);
  if (!finite || !(condition <= double{kMaxCondition}) || !back.exists())
    return tl::unexpected(invalid(place(group, i) + "the transform has no inverse that floats can hold: determinant " +
                                  text(inverse.determinant) + (finite ? ", condition " + text(condition) : "")));
  return record;
}

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

/// Adds instance @p i, which has a motion. @return kInvalidInput for one that cannot be.
Result<InstanceRecord> add_motion(Group& group, const Instance& instance, const ObjectRecord& object,
                                  std::size_t number, std::size_t i) {
  auto parts = make_motion(*instance.motion);
  if (!parts) return tl::unexpected(invalid(place(number, i) + parts.error().message));
  auto record = make_record(instance, parts->first.to_scene, number, i);
  if (!record || parts->segments.empty()) return record;
  group.motions.resize(group.records.size());
  group.motions[i] = {group.segments.size() * sizeof(MotionSegment),
                      static_cast<std::uint32_t>(parts->segments.size()),
                      instance.motion->kind,
                      affine_detail::round_up(parts->magnification.rounding),
                      affine_detail::round_up(parts->magnification.farthest),
                      {}};
  group.segments.insert(group.segments.end(), parts->segments.begin(), parts->segments.end());
  if (object.root == kInvalidRef) return record;
  group.needs.add(*record, object, parts->magnification);
  group.needs.features |= feature_bit(Feature::kMotion);
  return record;
}

/// The parts that leaves are for, and their boxes.
class PartBoxes {
 public:
  PartBoxes(Group& group, std::span<const ObjectParts> objects, InstanceBounds bounds)
      : group_(group), objects_(objects), bounds_(bounds) {}

  /// One part per instance.
  void make(CpuEngine& engine) {
    const std::size_t count = group_.records.size();
    group_.parts.resize(count);
    group_.boxes.resize(count);
    // Boxes of deep bounds take a while each.
    constexpr std::size_t kChunk = 64;
    engine.for_quiet_chunks(
        count,
        [&](std::size_t, std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            group_.parts[i] = {static_cast<std::uint32_t>(i), objects_[group_.records[i].object].record.root};
            group_.boxes[i] = box_of(group_.parts[i]);
          }
        },
        kChunk);
  }

  /// Puts the children of the parts with the largest boxes into their places, until there are @p budget times as many
  /// as instances.
  void open(CpuEngine& engine, double budget) {
    const auto most = static_cast<std::size_t>(budget * static_cast<double>(group_.records.size()));
    std::priority_queue<std::pair<float, std::size_t>> largest;
    const auto offer = [&](std::size_t i) {
      const InstancePart& part = group_.parts[i];
      if (part.ref != kInvalidRef && is_box(part.ref) && part.depth < kMostOpenedLevels)
        largest.emplace(half_area(group_.boxes[i]), i);
    };
    for (std::size_t i = 0; i < group_.parts.size(); ++i) offer(i);
    while (!largest.empty() && group_.parts.size() + kBranching - 1 <= most) {
      if (group_.parts.size() % 256 == 0) engine.monitor().check();
      const std::size_t opened = largest.top().second;
      largest.pop();
      const InstancePart part = group_.parts[opened];
      bool first = true;
      for (const NodeRef child : children_of(part)) {
        if (child == kInvalidRef) continue;
        const std::size_t at = first ? opened : group_.parts.size();
        if (!first) {
          group_.parts.emplace_back();
          group_.boxes.emplace_back();
        }
        first = false;
        group_.parts[at] = {part.instance, child, part.depth + 1};
        group_.boxes[at] = box_of(group_.parts[at]);
        offer(at);
      }
    }
  }

 private:
  static float half_area(const Box& box) {
    const float x = box.max[0] - box.min[0], y = box.max[1] - box.min[1], z = box.max[2] - box.min[2];
    return x * y + y * z + z * x;
  }

  const BufferView& object_of(const InstancePart& part) const {
    return objects_[group_.records[part.instance].object].view;
  }

  std::array<NodeRef, kBranching> children_of(const InstancePart& part) const {
    const BufferView& object = object_of(part);
    return dispatch_layout(object.layout(), [&](auto layout) {
      using Node = typename decltype(layout)::Node;
      const auto& node = *reinterpret_cast<const Node*>(object.bytes.data() + ref_offset(part.ref));
      std::array<NodeRef, kBranching> children;
      std::copy_n(node.child, kBranching, children.begin());
      return children;
    });
  }

  Box box_of(const InstancePart& part) const {
    if (part.ref == kInvalidRef) return format_detail::empty_box();
    const BufferView& object = object_of(part);
    return dispatch_layout(object.layout(), [&](auto layout) {
      using Bounder = format_detail::InstanceBounder<decltype(layout)>;
      const std::size_t i = part.instance;
      const format_detail::InstancePlace place(group_.records[i], group_.motion_of(i),
                                               group_.motions.empty() ? MotionKind{} : group_.motions[i].kind);
      return Bounder(object, place)
          .bounds(part.ref,
                  bounds_ == InstanceBounds::kPrimitives ? Bounder::kToPrimitives : static_cast<unsigned>(bounds_));
    });
  }

  Group& group_;
  std::span<const ObjectParts> objects_;
  InstanceBounds bounds_;
};

Result<Group> prepare_group(CpuEngine& engine, std::span<const Instance> instances,
                            std::span<const ObjectParts> objects, const InstanceOptions& options, std::size_t number) {
  Group group;
  group.records.resize(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (instances[i].object >= objects.size())
      return tl::unexpected(invalid(place(number, i) + "object " + std::to_string(instances[i].object) +
                                    ", those before the group are " + std::to_string(objects.size())));
    const ObjectRecord& object = objects[instances[i].object].record;
    auto record = instances[i].motion != nullptr ? add_motion(group, instances[i], object, number, i)
                                                 : make_record(instances[i], instances[i].to_scene, number, i);
    if (!record) return tl::unexpected(std::move(record.error()));
    group.records[i] = *record;
    if (object.root != kInvalidRef && group.motion_of(i).empty()) group.needs.add(*record, object);
  }
  if (!(group.needs.condition <= double{kMaxCondition}) ||
      !(group.needs.reach <= double{std::numeric_limits<float>::max()}))
    return tl::unexpected(
        invalid("group " + std::to_string(number) + ": the transforms on the way to a primitive have a condition of " +
                text(group.needs.condition) + " together, the limit is " + text(double{kMaxCondition})));
  PartBoxes boxes(group, objects, options.bounds);
  boxes.make(engine);
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (group.parts[i].ref != kInvalidRef && format_detail::first_bad_plane(group.boxes[i]) != format_detail::kNoPlane)
      return tl::unexpected(invalid(place(number, i) + "its bounds are beyond what floats hold"));
  boxes.open(engine, options.opening_budget);
  return group;
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
void name_instances(std::byte* bytes, const Group& group, std::span<SectionEntry> sections) {
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
    const InstancePart& part = group.parts[leaf.info.primitive[0]];
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

/// The file of a tree over instances' boxes, with the instances, and for the scene all objects.
/// @param group whose motions get their segments' place.
/// @param all_objects of the scene's file; else none.
Buffer finish_file(const BufferView& tree, Group& group, std::span<const ObjectParts> all_objects) {
  const FileHeader& from = *tree.header;
  const unsigned more = 1 + (group.motions.empty() ? 0 : 2) + (all_objects.empty() ? 0 : 2);
  const std::uint64_t shift = room_wanted(tree, more);
  const auto* table = reinterpret_cast<const SectionEntry*>(tree.bytes.data() + sizeof(FileHeader));
  std::vector<SectionEntry> sections(table, table + from.section_count);
  for (SectionEntry& section : sections) section.offset += shift;
  std::uint64_t end = tree.bytes.size() + shift;
  const auto add = [&](SectionKind kind, std::uint64_t alignment, std::uint64_t count, std::uint64_t stride) {
    sections.push_back({static_cast<std::uint32_t>(kind), kSectionRequired, align(end, alignment), count, stride});
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
  std::uint64_t object_table = 0;
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
    for (std::size_t g = 0;; ++g) {
      const bool last = g + 1 == scene_.groups.size();
      const std::span<const ObjectParts> before(objects_);
      auto group = prepare_group(engine_, scene_.groups[g], before, options_, g);
      if (!group) return tl::unexpected(std::move(group.error()));
      auto tree = build_tree(group->boxes, g);
      if (!tree) return tl::unexpected(std::move(tree.error()));
      Buffer file =
          finish_file(*open_buffer(tree->buffer.bytes()), *group, last ? before : std::span<const ObjectParts>{});
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
  if (!(options.opening_budget >= 1.0 && options.opening_budget <= 16.0))
    return tl::unexpected(invalid("opening_budget is " + text(options.opening_budget) + ", 1 to 16 expected"));
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
