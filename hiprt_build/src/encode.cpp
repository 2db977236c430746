#include <hiprt_build/buffer.h>
#include <hiprt_build/steps/encode.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/checksum.h>
#include <hiprt_device/format/layout.h>

#include <atomic>
#include <cstring>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskNodes = 1024;
constexpr unsigned kSections = 5;

std::uint64_t align(std::uint64_t offset) {
  return (offset + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
}

/// Places of the sections, in the order of SectionKind.
struct FilePlan {
  SectionEntry section[kSections];
  std::uint64_t byte_size = 0;

  FilePlan(std::uint64_t nodes, std::uint64_t leaves, std::uint64_t primitives, std::uint64_t geometries,
           std::uint64_t text) {
    const std::uint64_t counts[kSections] = {nodes, leaves, primitives, geometries, text};
    const std::uint64_t strides[kSections] = {sizeof(FloatBoxNode), sizeof(FloatLeaf), sizeof(std::uint32_t),
                                              sizeof(GeometryRecord), 1};
    byte_size = sizeof(FileHeader) + kSections * sizeof(SectionEntry);
    for (std::uint32_t i = 0; i < kSections; ++i) {
      const auto kind = static_cast<SectionKind>(i + 1);
      section[i] = SectionEntry{i + 1, kind == SectionKind::kProvenance ? 0 : kSectionRequired, align(byte_size),
                                counts[i], strides[i]};
      byte_size = section[i].offset + counts[i] * strides[i];
    }
  }
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

  /// Fills nodes, leaves and primitive map. @return the root reference.
  NodeRef run() {
    std::fill_n(map_, plan_.section[2].count, kInvalidId);
    const std::size_t leaves = input_.tree.references.size();
    if (leaves == 0) return kInvalidRef;
    engine_.for_each(leaves, [this](std::size_t i) { write_leaf(i); });
    if (input_.wide.is_run(0)) {
      end_run(0);
      return leaf_ref(0);
    }
    stack_bound_ = write_node(0, 0, 1);
    return node_ref(0);
  }
  std::uint32_t stack_bound() const { return stack_bound_; }

 private:
  NodeRef node_ref(std::uint64_t i) const {
    return make_ref(plan_.section[0].offset + i * sizeof(Node), NodeType::kBox32);
  }
  NodeRef leaf_ref(std::uint64_t i) const {
    return make_ref(plan_.section[1].offset + i * sizeof(Leaf), NodeType::kTriangle0);
  }

  void write_leaf(std::size_t i) {
    const TriangleGroup group = input_.grouped.groups[input_.tree.references[i].leaf];
    const std::array<Position, 4> vertices = group.vertices(input_.soup);
    Leaf leaf{};
    for (unsigned v = 0; v < 4; ++v)
      for (unsigned axis = 0; axis < 3; ++axis) Layout::set_coordinate(leaf, v, axis, vertices[v][axis]);
    leaf.info.primitive[0] = group.triangle[0];
    leaf.info.primitive[1] = group.triangle[1];
    leaf.info.geometry_and_flags = group.mesh;
    leaf.info.triangle_ids = TriangleId::from_rotation(group.rotation0);
    if (group.is_pair()) leaf.info.triangle_ids |= TriangleId::from_rotation(group.rotation1) << 8;
    leaves_[i] = leaf;
    for (std::uint32_t t = 0; t < (group.is_pair() ? 2u : 1u); ++t)
      lower(map_[input_.soup.first[group.mesh] + group.triangle[t]], static_cast<std::uint32_t>(2 * i + t));
  }

  /// value = min(value, candidate), whichever thread comes first.
  static void lower(std::uint32_t& value, std::uint32_t candidate) {
    std::atomic_ref<std::uint32_t> shared(value);
    std::uint32_t there = shared.load(std::memory_order_relaxed);
    while (candidate < there && !shared.compare_exchange_weak(there, candidate, std::memory_order_relaxed)) {
    }
  }

  void end_run(std::uint32_t binary) {
    const BinaryNode& node = input_.tree.nodes[binary];
    leaves_[node.first + node.count - 1].info.geometry_and_flags |= kLastInRun;
  }

  /// Writes the wide node of a binary node to nodes_[at] and its subtree to nodes_[next, ...).
  /// @return the stack entries its traversal can need.
  std::uint32_t write_node(std::uint32_t binary, std::uint64_t at, std::uint64_t next) {
    const WideTree::Children children = input_.wide.children(binary);
    Node node{};
    std::uint32_t need[kBranching] = {};
    std::uint64_t slot[kBranching], subtree[kBranching];
    plan_children(children, next, slot, subtree);
    for (unsigned i = 0; i < kBranching; ++i) {
      node.child[i] = kInvalidRef;
      Layout::set_box(node, i, to_box(Aabb{}));
      if (i >= children.count) continue;
      const std::uint32_t child = children.node[i];
      Layout::set_box(node, i, to_box(input_.tree.nodes[child].box()));
      node.child_flags |= (kChildOnlyOpaque | kChildOnlyTriangles) << (8 * i);
      node.child[i] = input_.wide.is_run(child) ? leaf_ref(input_.tree.nodes[child].first) : node_ref(slot[i]);
      if (input_.wide.is_run(child)) end_run(child);
    }
    nodes_[at] = node;
    const auto descend = [&](unsigned i) {
      if (i < children.count && !input_.wide.is_run(children.node[i]))
        need[i] = write_node(children.node[i], slot[i], subtree[i]);
    };
    if (input_.wide.node_count(binary) < kTaskNodes) {
      for (unsigned i = 0; i < kBranching; ++i) descend(i);
    } else {
      engine_.monitor().check();
      engine_.invoke([&] { engine_.invoke([&] { descend(0); }, [&] { descend(1); }); },
                     [&] { engine_.invoke([&] { descend(2); }, [&] { descend(3); }); });
    }
    return children.count - 1 + *std::max_element(need, need + kBranching);
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
  std::uint32_t stack_bound_ = 0;
};

/// Geometry table. @return the features it calls for.
FeatureMask write_geometries(const EncodeInput& input, GeometryRecord* records) {
  FeatureMask features = 0;
  for (std::size_t i = 0; i < input.soup.meshes.size(); ++i) {
    const TriangleMesh& mesh = input.soup.meshes[i];
    records[i] = GeometryRecord{input.soup.first[i], mesh.triangles.size(), input.grouped.dropped[i], mesh.mask, 0};
    if (mesh.mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  }
  return features;
}

FileHeader make_header(const EncodeInput& input, const FilePlan& plan, NodeRef root, std::uint32_t stack_bound,
                       FeatureMask features) {
  FileHeader header{};
  std::copy_n(kMagic, sizeof(kMagic), header.magic);
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(input.layout);
  const std::size_t references = input.tree.references.size();
  if (references != 0) features |= feature_bit(Feature::kTriangles);
  if (references > input.grouped.count) features |= feature_bit(Feature::kSplitReferences);
  header.features = features;
  header.byte_size = plan.byte_size;
  header.section_count = kSections;
  header.root = root;
  header.stack_bound = stack_bound;
  header.geometry_count = static_cast<std::uint32_t>(input.soup.meshes.size());
  header.bounds = to_box(references == 0 ? Aabb{} : input.tree.nodes[0].box());
  header.primitive_count = input.soup.size();
  return header;
}

}  // namespace

Result<void> check_addresses(std::uint64_t nodes, std::uint64_t leaves) {
  const std::uint64_t end = FilePlan(nodes, leaves, 0, 0, 0).section[1].offset + leaves * sizeof(FloatLeaf);
  if (end <= kAddressLimit) return {};
  return tl::unexpected(Error{
      ErrorCode::kTooLarge, std::to_string(nodes) + " nodes and " + std::to_string(leaves) + " leaves end at byte " +
                                std::to_string(end) + ", a node reference addresses " + std::to_string(kAddressLimit)});
}

Result<Buffer> encode(CpuEngine& engine, const EncodeInput& input) {
  const std::size_t leaves = input.tree.references.size();
  const std::uint64_t nodes = leaves == 0 || input.wide.is_run(0) ? 0 : input.wide.node_count(0);
  if (auto addresses = check_addresses(nodes, leaves); !addresses) return tl::unexpected(addresses.error());
  const FilePlan plan(nodes, leaves, input.soup.size(), input.soup.meshes.size(), input.provenance.size());
  engine.monitor().start("encode", 0.95, leaves);
  engine.ledger().add(plan.byte_size);
  Buffer buffer(plan.byte_size);
  std::byte* bytes = buffer.bytes().data();
  const auto [root, stack_bound] = dispatch_layout(input.layout, [&](auto layout) {
    Encoder<decltype(layout)> encoder(engine, input, plan, bytes);
    const NodeRef ref = encoder.run();
    return std::pair{ref, encoder.stack_bound()};
  });
  const FeatureMask features =
      write_geometries(input, reinterpret_cast<GeometryRecord*>(bytes + plan.section[3].offset));
  std::memcpy(bytes + plan.section[4].offset, input.provenance.data(), input.provenance.size());
  std::memcpy(bytes + sizeof(FileHeader), plan.section, sizeof(plan.section));
  auto& header = *reinterpret_cast<FileHeader*>(bytes);
  header = make_header(input, plan, root, stack_bound, features);
  engine.monitor().start("checksum", 1.0, 1);
  header.checksum = file_checksum(buffer.bytes());
  return buffer;
}

}  // namespace hiprt::build
