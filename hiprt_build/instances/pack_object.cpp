#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/instances/pack_object.h>

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/input/check_input.h>

#include <algorithm>
#include <cstring>

namespace hiprt::build {
namespace {

/// Walks a tree in a copy of device memory and writes it as a file.
template <class Layout> class Packer {
  using Node = typename Layout::Node;

 public:
  Packer(std::span<const std::byte> memory, std::span<const InstanceRecord> instances, const ObjectRecord& there,
         std::span<const PackedObject> others)
      : memory_(memory), records_(instances), there_(there), others_(others), instances_(there.instances != 0) {}

  Result<PackedObject> pack(float shutter_begin, float shutter_rate) {
    if (!read_geometries() || !walk() || !read_instances()) return tl::unexpected(invalid("device memory is no tree"));
    fill_map();
    write(shutter_begin, shutter_rate);
    return std::move(packed_);
  }

 private:
  template <class T> const T* at(std::uint64_t offset) const {
    return offset <= memory_.size() && memory_.size() - offset >= sizeof(T)
               ? reinterpret_cast<const T*>(memory_.data() + offset)
               : nullptr;
  }

  /// Trees of batches have no header, and one geometry.
  bool read_geometries() {
    if (there_.root == kInvalidRef) return true;
    const auto* header = at<FileHeader>(0);
    const bool has_header = header != nullptr && std::memcmp(header->magic, kMagic, sizeof(kMagic)) == 0;
    const std::uint32_t count = has_header && !instances_ ? header->geometry_count : 1;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto* record = at<GeometryRecord>(there_.geometries + i * sizeof(GeometryRecord));
      if (record == nullptr) return false;
      geometries_.push_back(*record);
    }
    return true;
  }

  /// Nodes in the order of a depth-first traversal: each behind its parent.
  bool walk() {
    if (there_.root == kInvalidRef) return true;
    if (!is_box(there_.root)) return add_run(there_.root);
    std::vector<NodeRef> pending{there_.root};
    while (!pending.empty()) {
      const NodeRef ref = pending.back();
      pending.pop_back();
      const auto* node = at<Node>(ref_offset(ref));
      // Every record is visited once, so more of them than fit are a loop.
      if (node == nullptr || nodes_.size() > memory_.size() / sizeof(Node)) return false;
      numbers_[ref] = nodes_.size();
      nodes_.push_back(*node);
      for (const NodeRef child : node->child) {
        if (child == kInvalidRef) continue;
        if (is_box(child))
          pending.push_back(child);
        else if (!add_run(child))
          return false;
      }
    }
    return true;
  }
  bool add_run(NodeRef ref) {
    numbers_[ref] = leaves_.size();
    for (std::uint64_t offset = ref_offset(ref);; offset += sizeof(CustomLeaf)) {
      const auto* leaf = at<CustomLeaf>(offset);
      if (leaf == nullptr || leaves_.size() > memory_.size() / sizeof(CustomLeaf)) return false;
      if ((leaf->info.geometry_and_flags & kGeometryMask) >= geometries_.size()) return false;
      leaves_.push_back(*leaf);
      if ((leaf->info.geometry_and_flags & kLastInRun) != 0) return true;
    }
  }

  bool read_instances() {
    if (!instances_) return true;
    const std::uint64_t count = geometries_[0].primitive_count;
    if (records_.size() != count) return false;
    bool good = true;
    std::vector<MotionRecord> motions;
    for (std::uint64_t i = 0; there_.motions != 0 && i < count && good; ++i) {
      const auto* motion = at<MotionRecord>(there_.motions + i * sizeof(MotionRecord));
      good = motion != nullptr &&
             (motion->count == 0 ||
              at<MotionSegment>(motion->segments + (motion->count - 1) * sizeof(MotionSegment)) != nullptr);
      if (good) motions.push_back(*motion);
    }
    if (!good) return false;
    motions_ = pack_motions(motions, [&](std::uint64_t offset) { return *at<MotionSegment>(offset); });
    return std::all_of(leaves_.begin(), leaves_.end(), [&](CustomLeaf& leaf) { return enter(leaf); });
  }
  /// Lets an instance's leaf name the packed object's node.
  bool enter(CustomLeaf& leaf) const {
    const std::uint32_t instance = leaf.info.primitive[0];
    if (instance >= records_.size() || records_[instance].object >= others_.size()) return false;
    const auto& refs = others_[records_[instance].object].refs;
    const auto found = refs.find(leaf.info.primitive[1]);
    if (found == refs.end()) return false;
    leaf.info.primitive[1] = found->second;
    return true;
  }

  /// Calls visit(geometry, primitive, number of the leaf * 2 + slot).
  template <class Visit> void for_each_primitive(const Visit& visit) const {
    for (std::size_t i = 0; i < leaves_.size(); ++i)
      for (std::uint32_t slot = 0; slot < (instances_ ? 1u : 2u); ++slot)
        if (leaves_[i].info.primitive[slot] != kInvalidId)
          visit(leaves_[i].info.geometry_and_flags & kGeometryMask, leaves_[i].info.primitive[slot],
                static_cast<std::uint32_t>(2 * i + slot));
  }

  void fill_map() {
    // A batch does not write how many primitives a tree has.
    for_each_primitive([&](std::uint32_t geometry, std::uint32_t primitive, std::uint32_t) {
      std::uint64_t& count = geometries_[geometry].primitive_count;
      count = std::max<std::uint64_t>(count, std::uint64_t{primitive} + 1);
    });
    std::uint64_t first = 0;
    for (GeometryRecord& geometry : geometries_) {
      geometry.first_primitive = first;
      first += geometry.primitive_count;
    }
    map_.assign(static_cast<std::size_t>(first), kInvalidId);
    for_each_primitive([&](std::uint32_t geometry, std::uint32_t primitive, std::uint32_t place) {
      map_[static_cast<std::size_t>(geometries_[geometry].first_primitive) + primitive] = place;
    });
    for (GeometryRecord& geometry : geometries_) {
      const auto begin = map_.begin() + static_cast<std::ptrdiff_t>(geometry.first_primitive);
      geometry.dropped_count = static_cast<std::uint64_t>(
          std::count(begin, begin + static_cast<std::ptrdiff_t>(geometry.primitive_count), kInvalidId));
    }
  }

  NodeRef moved(NodeRef ref, const FileLayout& file) const {
    const std::uint64_t number = numbers_.at(ref);
    return is_box(ref) ? make_ref(file[kNodesAt].offset + number * sizeof(Node), ref_type(ref))
                       : make_ref(file[kLeavesAt].offset + number * sizeof(CustomLeaf), ref_type(ref));
  }

  template <class Records> static void put(std::byte* bytes, const SectionEntry& section, const Records& records) {
    const auto raw = std::as_bytes(std::span(records));
    std::copy(raw.begin(), raw.end(), bytes + section.offset);
  }

  /// Instances and motions take the place of the provenance.
  FileLayout plan(bool moves) {
    FileLayout file(kProvenanceAt + (!instances_ ? 0 : moves ? 3 : 1));
    file.add(SectionKind::kNodes, nodes_.size(), sizeof(Node));
    file.add(SectionKind::kLeaves, leaves_.size(), sizeof(CustomLeaf));
    file.add(SectionKind::kPrimitiveMap, map_.size(), sizeof(std::uint32_t));
    file.add(SectionKind::kGeometries, geometries_.size(), sizeof(GeometryRecord));
    if (instances_) file.add(SectionKind::kInstances, records_.size(), sizeof(InstanceRecord));
    if (!moves) return file;
    file.add(SectionKind::kMotions, motions_.records.size(), sizeof(MotionRecord));
    const std::uint64_t segments =
        file.add(SectionKind::kMotionSegments, motions_.segments.size(), sizeof(MotionSegment));
    for (MotionRecord& motion : motions_.records)
      if (motion.count != 0) motion.segments += segments;
    return file;
  }

  void write(float shutter_begin, float shutter_rate) {
    const bool moves = !motions_.segments.empty();
    const FileLayout file = plan(moves);
    for (Node& node : nodes_)
      for (NodeRef& child : node.child)
        if (child != kInvalidRef) child = moved(child, file);
    for (const auto& [ref, number] : numbers_) packed_.refs.emplace(ref, moved(ref, file));
    packed_.file = Buffer(static_cast<std::size_t>(file.byte_size()));
    std::byte* bytes = packed_.file.bytes().data();
    put(bytes, file[kNodesAt], nodes_);
    put(bytes, file[kLeavesAt], leaves_);
    put(bytes, file[kPrimitiveMapAt], map_);
    put(bytes, file[kGeometriesAt], geometries_);
    if (instances_) put(bytes, file[kProvenanceAt], records_);
    if (moves) {
      put(bytes, file[kProvenanceAt + 1], motions_.records);
      put(bytes, file[kProvenanceAt + 2], motions_.segments);
    }
    describe(file, moves);
    FileHeader header = make_header(file);
    if ((header.features & feature_bit(Feature::kMovingBoxes)) != 0) {
      header.shutter_begin = shutter_begin;
      header.shutter_rate = shutter_rate;
    }
    std::memcpy(bytes, &header, sizeof(header));
    std::memcpy(bytes + sizeof(header), file.begin(), file.count() * sizeof(SectionEntry));
    reinterpret_cast<FileHeader*>(bytes)->checksum = file_checksum(std::as_const(packed_.file).bytes());
  }

  void describe(const FileLayout& file, bool moves) {
    ObjectRecord& record = packed_.record;
    record = there_;
    // The header of the copy states no margin.
    record.features &= ~feature_bit(Feature::kWidenedBoxes);
    record.offset = 0;
    record.size = file.byte_size();
    record.geometries = file[kGeometriesAt].offset;
    record.instances = instances_ ? file[kProvenanceAt].offset : 0;
    record.motions = moves ? file[kProvenanceAt + 1].offset : 0;
    record.root = there_.root == kInvalidRef ? kInvalidRef : moved(there_.root, file);
    record.reserved = 0;
  }

  FileHeader make_header(const FileLayout& file) const {
    FileHeader header{};
    std::memcpy(header.magic, kMagic, sizeof(kMagic));
    header.version_major = kVersionMajor;
    header.version_minor = kVersionMinor;
    header.layout = static_cast<std::uint32_t>(Layout::kId);
    header.features = packed_.record.features;
    header.byte_size = file.byte_size();
    header.section_count = file.count();
    header.root = packed_.record.root;
    header.stack_bound = packed_.record.stack_bound;
    header.geometry_count = static_cast<std::uint32_t>(geometries_.size());
    header.bounds = packed_.record.bounds;
    header.primitive_count = map_.size();
    header.levels = packed_.record.levels;
    header.condition = packed_.record.condition;
    header.reach = packed_.record.reach;
    return header;
  }

  std::span<const std::byte> memory_;
  std::span<const InstanceRecord> records_;
  const ObjectRecord& there_;
  std::span<const PackedObject> others_;
  bool instances_;
  std::vector<GeometryRecord> geometries_;
  std::vector<Node> nodes_;
  std::vector<CustomLeaf> leaves_;  ///< Of any kind: all leaves have one size.
  std::vector<std::uint32_t> map_;
  PackedMotions motions_;
  std::unordered_map<NodeRef, std::uint64_t> numbers_;  ///< Of box nodes and of the first leaves of runs.
  PackedObject packed_;
};

}  // namespace

Result<PackedObject> pack_object(std::span<const std::byte> memory, std::span<const InstanceRecord> instances,
                                 const ObjectRecord& there, NodeLayout layout, float shutter_begin, float shutter_rate,
                                 std::span<const PackedObject> others) {
  return dispatch_layout(layout, [&](auto tag) {
    return Packer<decltype(tag)>(memory, instances, there, others).pack(shutter_begin, shutter_rate);
  });
}

}  // namespace hiprt::build
