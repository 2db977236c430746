#include <hiprt_build/instances/instance_file.h>

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/file_layout.h>

#include <algorithm>
#include <cstring>
#include <tuple>

namespace hiprt::build {
namespace {

/// Offset of the first of a tree's sections.
std::size_t first_section(const BufferView& tree) {
  std::uint64_t first = tree.bytes.size();
  for (const SectionEntry* section : {&tree.nodes, &tree.leaves, &tree.primitive_map_entry, &tree.geometry_entry})
    first = std::min(first, section->offset);
  return static_cast<std::size_t>(first);
}

/// By how many bytes the sections of a tree move to make space for a larger table.
/// @param sections entries of the larger table.
std::uint64_t shift_for_table(const BufferView& tree, std::uint32_t sections) {
  const std::uint64_t table_end = FileLayout::head_size(sections), first = first_section(tree);
  return table_end <= first ? 0 : align_up(table_end - first, kSectionAlignment);
}

/// A reference to what has moved back by @p shift bytes.
NodeRef shifted(NodeRef ref, std::uint64_t shift) { return make_ref(ref_offset(ref) + shift, ref_type(ref)); }

/// For each object the offset of its shapes; empty if none has any.
std::vector<std::uint64_t> shape_offsets(std::span<const ObjectParts> objects) {
  std::vector<std::uint64_t> result;
  for (const ObjectParts& object : objects) result.push_back(object.view.shape_entry.offset);
  if (std::all_of(result.begin(), result.end(), [](std::uint64_t offset) { return offset == 0; })) result.clear();
  return result;
}

class InstanceFile {
 public:
  InstanceFile(const BufferView& tree, InstanceGroup& group, std::span<const ObjectParts> all_objects)
      : tree_(tree), group_(group), all_objects_(all_objects), shapes_(shape_offsets(all_objects)) {
    plan_sections();
    if (!group.motions.empty()) plan_motions();
    if (!shapes_.empty())
      object_shapes_ = layout_.add(SectionKind::kObjectShapes, shapes_.size(), sizeof(std::uint64_t), 0);
    if (!all_objects.empty()) plan_objects();
  }

  Buffer write(const std::optional<Shutter>& shutter) {
    Buffer buffer(layout_.byte_size());
    bytes_ = buffer.bytes().data();
    std::memcpy(bytes_, tree_.bytes.data(), sizeof(FileHeader));
    const std::size_t first = first_section(tree_);
    std::memcpy(bytes_ + first + shift_, tree_.bytes.data() + first, tree_.bytes.size() - first);
    name_instances();
    std::memcpy(bytes_ + sizeof(FileHeader), layout_.begin(), layout_.count() * sizeof(SectionEntry));
    put(instances_, group_.records);
    put(motions_, group_.motions);
    put(segments_, group_.segments);
    put(object_table_, objects_);
    put(object_shapes_, shapes_);
    for (std::size_t i = 0; i < objects_.size(); ++i)
      std::memcpy(bytes_ + objects_[i].offset, all_objects_[i].view.bytes.data(), objects_[i].size);
    write_header(shutter);
    if (shift_ != 0) shift_nodes();
    header().checksum = file_checksum(buffer.bytes());
    return buffer;
  }

 private:
  FileHeader& header() { return *reinterpret_cast<FileHeader*>(bytes_); }

  /// The sections of the tree and the instances.
  void plan_sections() {
    const std::uint32_t more = 1 + (group_.motions.empty() ? 0 : 2) + (all_objects_.empty() ? 0 : 2) +
                               (shapes_.empty() ? 0 : 1),
                        count = tree_.header->section_count;
    shift_ = shift_for_table(tree_, count + more);
    layout_ = FileLayout(count + more);
    const auto* table = reinterpret_cast<const SectionEntry*>(tree_.bytes.data() + sizeof(FileHeader));
    for (std::uint32_t i = 0; i < count; ++i) {
      SectionEntry section = table[i];
      section.offset += shift_;
      layout_.keep(section, tree_.bytes.size() + shift_);
    }
    instances_ = layout_.add(SectionKind::kInstances, group_.records.size(), sizeof(InstanceRecord));
  }

  void plan_motions() {
    motions_ = layout_.add(SectionKind::kMotions, group_.motions.size(), sizeof(MotionRecord));
    segments_ = layout_.add(SectionKind::kMotionSegments, group_.segments.size(), sizeof(MotionSegment));
    for (MotionRecord& motion : group_.motions)
      if (motion.count != 0) motion.segments += segments_;
  }

  void plan_objects() {
    object_table_ = layout_.add(SectionKind::kObjects, all_objects_.size(), sizeof(ObjectRecord));
    const std::uint64_t begin = align_up(layout_.byte_size(), kBufferAlignment);
    std::uint64_t end = begin;
    for (const ObjectParts& object : all_objects_) {
      objects_.push_back(object.record);
      objects_.back().offset = align_up(end, kBufferAlignment);
      end = objects_.back().offset + object.record.size;
    }
    layout_.add(SectionKind::kObjectFiles, end - begin, 1, kSectionRequired, kBufferAlignment);
  }

  template <class Records> void put(std::uint64_t at, const Records& records) {
    const auto raw = std::as_bytes(std::span(records));
    std::copy(raw.begin(), raw.end(), bytes_ + at);
  }

  SectionEntry& section(SectionKind kind) {
    return *std::find_if(layout_.begin(), layout_.end(),
                         [&](const SectionEntry& entry) { return entry.kind == static_cast<std::uint32_t>(kind); });
  }

  /// Leaves, map and counts of a tree over parts become those of a tree over instances.
  void name_instances() {
    const SectionEntry& leaf_section = section(SectionKind::kLeaves);
    const std::span leaves(reinterpret_cast<CustomLeaf*>(bytes_ + leaf_section.offset),
                           static_cast<std::size_t>(leaf_section.count));
    for (CustomLeaf& leaf : leaves) {
      const std::size_t number = leaf.info.primitive[0];
      const InstancePart& part = group_.parts[number];
      if (!group_.moving_boxes.empty()) std::tie(leaf.box[0], leaf.box[1]) = group_.moving_boxes[number];
      leaf.info.primitive[0] = part.instance;
      leaf.info.primitive[1] = part.ref;
    }
    if (group_.parts.size() != group_.records.size()) map_instances();
  }

  /// The map of parts becomes one of instances: the first leaf of each.
  void map_instances() {
    SectionEntry& map_section = section(SectionKind::kPrimitiveMap);
    const std::span map(reinterpret_cast<std::uint32_t*>(bytes_ + map_section.offset), group_.parts.size());
    std::vector<std::uint32_t> by_instance(group_.records.size(), kInvalidId);
    for (std::size_t i = 0; i < map.size(); ++i) {
      std::uint32_t& leaf = by_instance[group_.parts[i].instance];
      if (leaf == kInvalidId) leaf = map[i];
    }
    std::fill(map.begin(), map.end(), 0u);
    std::copy(by_instance.begin(), by_instance.end(), map.begin());
    map_section.count = by_instance.size();
    const SectionEntry& geometry_section = section(SectionKind::kGeometries);
    reinterpret_cast<GeometryRecord*>(bytes_ + geometry_section.offset)->primitive_count = by_instance.size();
    header().primitive_count = by_instance.size();
  }

  void write_header(const std::optional<Shutter>& shutter) {
    header().features = group_.needs.features;
    header().byte_size = layout_.byte_size();
    header().section_count = layout_.count();
    header().stack_bound += group_.needs.stack;
    header().levels = group_.needs.levels;
    if (header().root != kInvalidRef) header().root = shifted(header().root, shift_);
    header().condition = affine_detail::round_up(group_.needs.condition);
    header().reach = affine_detail::round_up(group_.needs.reach);
    if (!shutter) return;
    header().shutter_begin = shutter->begin;
    header().shutter_rate = shutter->rate;
  }

  void shift_nodes() {
    dispatch_layout(tree_.layout(), [&](auto layout) {
      using Node = typename decltype(layout)::Node;
      const NodeArray<Node> nodes(bytes_ + tree_.nodes.offset + shift_, tree_.node_places());
      for (std::size_t i = 0, count = tree_.node_count(); i < count; ++i)
        for (NodeRef& child : nodes[i].child)
          if (child != kInvalidRef) child = shifted(child, shift_);
    });
  }

  const BufferView& tree_;
  InstanceGroup& group_;
  std::span<const ObjectParts> all_objects_;
  std::vector<std::uint64_t> shapes_;
  std::vector<ObjectRecord> objects_;
  FileLayout layout_;
  std::uint64_t shift_ = 0;  ///< Of the tree's sections.
  std::uint64_t instances_ = 0, motions_ = 0, segments_ = 0, object_table_ = 0, object_shapes_ = 0;  ///< Offsets.
  std::byte* bytes_ = nullptr;
};

}  // namespace

Buffer write_instance_file(const BufferView& tree, InstanceGroup& group, const std::optional<Shutter>& shutter,
                           std::span<const ObjectParts> all_objects) {
  return InstanceFile(tree, group, all_objects).write(shutter);
}

}  // namespace hiprt::build
