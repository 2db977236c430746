#include <hiprt_build/buffer.h>
#include <hiprt_build/encode/encode.h>
#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/input/provenance.h>
#include <hiprt_build/statistics/tree_quality.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/math/atomic.h>

#include <cstring>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskNodes = 1024;
/// Bytes that are cleared or summed up in less than a millisecond.
constexpr std::size_t kPiece = std::size_t{1} << 20;
/// Of every file, and those that come with shapes.
constexpr unsigned kSections = 5, kShapeSections = 3;

std::uint64_t align(std::uint64_t offset) {
  return (offset + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
}

/// Elements of the sections.
struct FileCounts {
  std::uint64_t nodes, leaves, primitives = 0, geometries = 0, text = 0;
  std::uint64_t shape_points = 0, curve_segments = 0;
  bool shapes = false;  ///< There are sections of shapes.
};

/// Places of the sections: those of every file in the order of SectionKind, then those of shapes.
struct FilePlan {
  SectionEntry section[kSections + kShapeSections];
  std::uint32_t count = 0;
  std::uint64_t byte_size = 0;

  FilePlan(NodeLayout layout, const FileCounts& counts) {
    byte_size = sizeof(FileHeader) + (kSections + (counts.shapes ? kShapeSections : 0)) * sizeof(SectionEntry);
    add(SectionKind::kNodes, counts.nodes, node_size(layout));
    add(SectionKind::kLeaves, counts.leaves, sizeof(FloatLeaf));
    add(SectionKind::kPrimitiveMap, counts.primitives, sizeof(std::uint32_t));
    add(SectionKind::kGeometries, counts.geometries, sizeof(GeometryRecord));
    add(SectionKind::kProvenance, counts.text, 1, 0);
    if (!counts.shapes) return;
    add(SectionKind::kShapes, counts.geometries, sizeof(ShapeRecord), 0);
    add(SectionKind::kShapePoints, counts.shape_points, sizeof(ShapePoint), 0);
    add(SectionKind::kCurveSegments, counts.curve_segments, sizeof(std::uint32_t), 0);
  }

 private:
  void add(SectionKind kind, std::uint64_t elements, std::uint64_t stride, std::uint32_t flags = kSectionRequired) {
    const SectionEntry entry{static_cast<std::uint32_t>(kind), flags, align(byte_size), elements, stride};
    section[count++] = entry;
    byte_size = entry.offset + elements * stride;
  }
};

FileCounts count_elements(const EncodeInput& input, std::uint64_t nodes) {
  FileCounts counts{nodes, input.tree.references.size(), input.soup.size(), input.soup.geometries(),
                    input.provenance.size()};
  for (const CustomGeometry& custom : input.soup.customs) {
    counts.shapes = counts.shapes || custom.shapes.kind != ShapeKind::kNone;
    counts.shape_points += custom.shapes.points.size();
    counts.curve_segments += custom.shapes.segments.size();
  }
  return counts;
}

/// What a parent needs to know of a child.
struct Subtree {
  WideChild child;
  std::uint32_t stack_need = 0;  ///< Entries that a traversal of it can need.
};

template <class Layout> class Encoder {
 public:
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  Encoder(CpuEngine& engine, const EncodeInput& input, const FilePlan& plan, std::byte* bytes)
      : engine_(engine),
        input_(input),
        plan_(plan),
        nodes_(reinterpret_cast<Node*>(bytes + plan.section[0].offset)),
        leaves_(reinterpret_cast<Leaf*>(bytes + plan.section[1].offset)),
        map_(reinterpret_cast<std::uint32_t*>(bytes + plan.section[2].offset)) {}

  /// Fills nodes, leaves and primitive map. @return the root, with the file's bounds.
  Subtree run() {
    engine_.fill(std::span(map_, plan_.section[2].count), kInvalidId);
    const std::size_t leaves = input_.tree.references.size();
    if (leaves == 0) return Subtree{};
    engine_.for_each(leaves, [this](std::size_t i) { write_leaf(i); });
    if (input_.wide.is_run(0)) return end_run(0);
    Subtree root = write_node(0, 0, 1);
    root.child.box = bounded(root.child.box, to_box(input_.tree.nodes[0].box()));
    return root;
  }

 private:
  NodeRef node_ref(std::uint64_t i) const {
    return make_ref(plan_.section[0].offset + i * sizeof(Node), Layout::kBoxType);
  }
  NodeRef leaf_ref(std::uint64_t i, NodeType type) const {
    return make_ref(plan_.section[1].offset + i * sizeof(Leaf), type);
  }

  void write_leaf(std::size_t i) {
    const PrimitiveGroup group = input_.grouped.groups[input_.tree.references[i].leaf];
    group.is_custom() ? write_custom_leaf(i, group) : write_triangle_leaf(i, group);
    for (std::uint32_t t = 0; t < (group.is_pair() ? 2u : 1u); ++t)
      lower(&map_[input_.soup.first[group.geometry] + group.primitive[t]], static_cast<std::uint32_t>(2 * i + t));
  }

  void write_triangle_leaf(std::size_t i, const PrimitiveGroup& group) {
    const std::array<Position, 4> vertices = group.vertices(input_.soup);
    Leaf leaf{};
    for (unsigned v = 0; v < 4; ++v)
      for (unsigned axis = 0; axis < 3; ++axis) Layout::set_coordinate(leaf, v, axis, vertices[v][axis]);
    leaf.info =
        make_info(group, TriangleId::from_rotation(group.rotation0), TriangleId::from_rotation(group.rotation1));
    leaves_[i] = leaf;
  }

  void write_custom_leaf(std::size_t i, const PrimitiveGroup& group) {
    CustomLeaf leaf{{input_.soup.box(group.geometry, group.primitive[0]), to_box(Aabb{})},
                    make_info(group, TriangleId::kCustom, TriangleId::kCustom)};
    if (group.is_pair()) leaf.box[1] = input_.soup.box(group.geometry, group.primitive[1]);
    std::memcpy(&leaves_[i], &leaf, sizeof(leaf));
  }

  static LeafInfo make_info(const PrimitiveGroup& group, std::uint32_t first_id, std::uint32_t second_id) {
    return LeafInfo{
        {group.primitive[0], group.primitive[1]}, group.geometry, first_id | (group.is_pair() ? second_id << 8 : 0u)};
  }

  /// The run of leaves of a binary node.
  Subtree end_run(std::uint32_t binary) {
    const BinaryNode& node = input_.tree.nodes[binary];
    leaves_[node.first + node.count - 1].info.geometry_and_flags |= kLastInRun;
    const bool custom = input_.wide.is_custom(binary);
    return Subtree{{leaf_ref(node.first, custom ? NodeType::kProcedural : NodeType::kTriangle0),
                    kChildOnlyOpaque | (custom ? kChildOnlyProcedural : kChildOnlyTriangles), to_box(node.box())}};
  }

  /// Writes the wide node of a binary node to nodes_[at] and its subtree to nodes_[next, ...).
  Subtree write_node(std::uint32_t binary, std::uint64_t at, std::uint64_t next) {
    const WideTree::Children children = input_.wide.children(binary);
    std::uint64_t slot[kBranching], subtree[kBranching];
    plan_children(children, next, slot, subtree);
    Subtree below[kBranching];
    const auto descend = [&](unsigned i) {
      if (i >= children.count) return;
      const std::uint32_t child = children.node[i];
      below[i] = input_.wide.is_run(child) ? end_run(child) : write_node(child, slot[i], subtree[i]);
    };
    if (input_.wide.node_count(binary) < kTaskNodes) {
      for (unsigned i = 0; i < kBranching; ++i) descend(i);
    } else {
      engine_.monitor().check();
      engine_.invoke([&] { engine_.invoke([&] { descend(0); }, [&] { descend(1); }); },
                     [&] { engine_.invoke([&] { descend(2); }, [&] { descend(3); }); });
    }
    return write_record(at, below, children.count);
  }

  /// The node over finished subtrees. What it states for itself is what its bytes decode to.
  Subtree write_record(std::uint64_t at, const Subtree (&below)[kBranching], unsigned count) {
    WideChild children[kBranching];
    Subtree result{{node_ref(at), below[0].child.flags}};
    for (unsigned i = 0; i < count; ++i) {
      children[i] = below[i].child;
      result.child.flags &= below[i].child.flags;
      result.stack_need = std::max(result.stack_need, below[i].stack_need);
    }
    result.stack_need += count - 1;
    nodes_[at] = make_node<Layout>(children);
    result.child.box = node_box<Layout>(nodes_[at]);
    return result;
  }

  /// Siblings get neighbouring slots from @p next on, then their subtrees follow one after the other.
  void plan_children(const WideTree::Children& children, std::uint64_t next, std::uint64_t* slot,
                     std::uint64_t* subtree) const {
    for (unsigned i = 0; i < children.count; ++i)
      if (!input_.wide.is_run(children.node[i])) slot[i] = next++;
    for (unsigned i = 0; i < children.count; ++i) {
      if (input_.wide.is_run(children.node[i])) continue;
      subtree[i] = next;
      next += input_.wide.node_count(children.node[i]) - 1;
    }
  }

  CpuEngine& engine_;
  const EncodeInput& input_;
  const FilePlan& plan_;
  Node* nodes_;
  Leaf* leaves_;
  std::uint32_t* map_;
};

/// Geometry table. @return the features it calls for.
FeatureMask write_geometries(const EncodeInput& input, GeometryRecord* records) {
  const PrimitiveSoup& soup = input.soup;
  FeatureMask features = 0;
  for (std::size_t i = 0; i < soup.geometries(); ++i) {
    const CustomGeometry* custom = i < soup.meshes.size() ? nullptr : &soup.customs[i - soup.meshes.size()];
    const std::uint32_t mask = custom != nullptr ? custom->mask : soup.meshes[i].mask;
    records[i] = GeometryRecord{soup.first[i], soup.size(i), input.grouped.dropped[i], mask,
                                custom != nullptr ? custom_geometry_flags(custom->type) : 0u};
    if (mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  }
  return features;
}

/// The sections of shapes, if there are any.
void write_shapes(CpuEngine& engine, const PrimitiveSoup& soup, const FilePlan& plan, std::byte* bytes) {
  if (plan.count == kSections) return;
  auto* record = reinterpret_cast<ShapeRecord*>(bytes + plan.section[kSections].offset) + soup.meshes.size();
  std::uint64_t points = plan.section[kSections + 1].offset, segments = plan.section[kSections + 2].offset;
  for (const CustomGeometry& custom : soup.customs) {
    const Shapes& shapes = custom.shapes;
    const bool curves = shapes.kind == ShapeKind::kCurves;
    if (shapes.kind != ShapeKind::kNone)
      *record = {points, curves ? segments : 0, static_cast<std::uint32_t>(shapes.points.size()), shapes.kind, {}};
    ++record;
    engine.copy(shapes.points, std::span(reinterpret_cast<ShapePoint*>(bytes + points), shapes.points.size()));
    engine.copy(shapes.segments, std::span(reinterpret_cast<std::uint32_t*>(bytes + segments), shapes.segments.size()));
    points += shapes.points.size_bytes();
    segments += shapes.segments.size_bytes();
  }
}

FileHeader make_header(const EncodeInput& input, const FilePlan& plan, const Subtree& root, FeatureMask features) {
  FileHeader header{};
  std::copy_n(kMagic, sizeof(kMagic), header.magic);
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(input.layout);
  const std::size_t references = input.tree.references.size();
  if (input.grouped.count > input.grouped.custom_count) features |= feature_bit(Feature::kTriangles);
  if (input.grouped.custom_count != 0) features |= feature_bit(Feature::kCustom);
  if (references > input.grouped.count) features |= feature_bit(Feature::kSplitReferences);
  header.features = features;
  header.byte_size = plan.byte_size;
  header.section_count = plan.count;
  header.root = root.child.ref;
  header.stack_bound = root.stack_need;
  header.geometry_count = static_cast<std::uint32_t>(input.soup.geometries());
  header.bounds = root.child.box;
  header.primitive_count = input.soup.size();
  return header;
}

/// Of the tree that is in the file.
template <class Layout> double exchange_slack(CpuEngine& engine, const FilePlan& plan, const std::byte* bytes) {
  const SectionEntry &nodes = plan.section[0], &leaves = plan.section[1];
  const TreeQuality<Layout> quality{reinterpret_cast<const FileHeader*>(bytes),
                                    reinterpret_cast<const typename Layout::Node*>(bytes + nodes.offset),
                                    reinterpret_cast<const typename Layout::Leaf*>(bytes + leaves.offset),
                                    nodes.offset,
                                    leaves.offset,
                                    {}};
  return sum_quality(engine, quality, nodes.count).exchange_slack();
}

}  // namespace

Result<void> check_addresses(NodeLayout layout, std::uint64_t nodes, std::uint64_t leaves) {
  const std::uint64_t end = FilePlan(layout, {nodes, leaves}).section[1].offset + leaves * sizeof(FloatLeaf);
  if (end <= kAddressLimit) return {};
  return tl::unexpected(Error{
      ErrorCode::kTooLarge, std::to_string(nodes) + " nodes and " + std::to_string(leaves) + " leaves end at byte " +
                                std::to_string(end) + ", a node reference addresses " + std::to_string(kAddressLimit)});
}

Result<Buffer> encode(CpuEngine& engine, const EncodeInput& input) {
  const std::size_t leaves = input.tree.references.size();
  const std::uint64_t nodes = leaves == 0 || input.wide.is_run(0) ? 0 : input.wide.node_count(0);
  if (auto addresses = check_addresses(input.layout, nodes, leaves); !addresses)
    return tl::unexpected(addresses.error());
  const FilePlan plan(input.layout, count_elements(input, nodes));
  engine.monitor().start("encode", 0.95, leaves);
  engine.ledger().add(plan.byte_size);
  Buffer buffer = Buffer::uninitialized(plan.byte_size);
  std::byte* bytes = buffer.bytes().data();
  engine.for_quiet_chunks(
      buffer.size(),
      [&](std::size_t, std::size_t begin, std::size_t end) { std::memset(bytes + begin, 0, end - begin); }, kPiece);
  const Subtree root = dispatch_layout(
      input.layout, [&](auto layout) { return Encoder<decltype(layout)>(engine, input, plan, bytes).run(); });
  const FeatureMask features =
      write_geometries(input, reinterpret_cast<GeometryRecord*>(bytes + plan.section[3].offset));
  write_shapes(engine, input.soup, plan, bytes);
  std::memcpy(bytes + sizeof(FileHeader), plan.section, plan.count * sizeof(SectionEntry));
  auto& header = *reinterpret_cast<FileHeader*>(bytes);
  header = make_header(input, plan, root, features);
  std::byte* provenance = bytes + plan.section[4].offset;
  std::memcpy(provenance, input.provenance.data(), input.provenance.size());
  const double slack =
      dispatch_layout(input.layout, [&](auto layout) { return exchange_slack<decltype(layout)>(engine, plan, bytes); });
  set_exchange_slack({reinterpret_cast<char*>(provenance), input.provenance.size()}, slack);
  engine.monitor().start("checksum", 1.0, 1);
  header.checksum = file_checksum(buffer.bytes(), kPiece, [&] { engine.monitor().check(); });
  return buffer;
}

}  // namespace hiprt::build
