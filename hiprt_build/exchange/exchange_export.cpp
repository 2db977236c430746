#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/exchange.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/format/validate.h>

namespace hiprt::build {
namespace {

template <class Layout> class Exporter {
 public:
  explicit Exporter(const BufferView& file)
      : file_(file),
        nodes_(file.node_array<typename Layout::Node>()),
        leaves_(file.records<typename Layout::Leaf>(file.leaves)),
        last_leaf_(file.primitive_map.size(), kInvalidId) {}

  ExchangeBvh run() {
    if (file_.header->root == kInvalidRef) return {};
    result_.nodes.reserve(file_.node_count());
    result_.primitives.reserve(2 * leaves_.size());
    result_.nodes.emplace_back();
    open_.push_back({file_.header->root, file_.header->bounds, 0});
    while (!open_.empty()) {
      const Open here = open_.back();
      open_.pop_back();
      is_box(here.ref) ? add_children(here) : add_leaf(here);
    }
    return std::move(result_);
  }

 private:
  /// What becomes node number `node`.
  struct Open {
    NodeRef ref;
    Box box;
    std::uint32_t node;
  };

  /// A node with one child is not exported: the child takes its place.
  void add_children(const Open& here) {
    const auto& node = nodes_[file_.node_number(here.ref)];
    Open children[kBranching];
    unsigned count = 0;
    for (unsigned i = 0; i < kBranching; ++i)
      if (node.child[i] != kInvalidRef)
        children[count++] = {node.child[i], stated_box<Layout>(node, i, file_.header->bounds), here.node};
    if (count == 1) return open_.push_back(children[0]);
    const auto first = static_cast<std::uint32_t>(result_.nodes.size());
    result_.nodes[here.node] = ExchangeNode{here.box, first, count, 0};
    result_.nodes.resize(first + count);
    for (unsigned i = count; i-- > 0;) {
      children[i].node = first + i;
      open_.push_back(children[i]);
    }
  }

  /// Parts of one primitive in one run are one entry.
  void add_leaf(const Open& here) {
    const auto first = static_cast<std::uint32_t>(result_.primitives.size());
    auto leaf = static_cast<std::size_t>((ref_offset(here.ref) - file_.leaves.offset) / sizeof(leaves_[0]));
    for (;; ++leaf) {
      const LeafInfo& info = leaves_[leaf].info;
      const std::uint64_t before = file_.geometries[info.geometry_and_flags & kGeometryMask].first_primitive;
      for (const std::uint32_t primitive : info.primitive)
        if (primitive != kInvalidId) add_primitive(before + primitive, here.node);
      if ((info.geometry_and_flags & kLastInRun) != 0) break;
    }
    const auto count = static_cast<std::uint32_t>(result_.primitives.size()) - first;
    result_.nodes[here.node] = ExchangeNode{here.box, first, 0, count};
  }

  void add_primitive(std::uint64_t number, std::uint32_t leaf) {
    if (std::exchange(last_leaf_[static_cast<std::size_t>(number)], leaf) != leaf)
      result_.primitives.push_back(static_cast<std::uint32_t>(number));
  }

  const BufferView& file_;
  NodeArray<const typename Layout::Node> nodes_;
  std::span<const typename Layout::Leaf> leaves_;
  std::vector<std::uint32_t> last_leaf_;  ///< Per primitive: the last node that holds it.
  std::vector<Open> open_;
  ExchangeBvh result_;
};

}  // namespace

Result<ExchangeBvh> export_tree(const BufferView& file) try {
  constexpr std::uint64_t kMostPrimitives = (std::uint64_t{1} << 31) - 1;
  if (const auto valid = hiprt::validate(file.bytes); !valid)
    return tl::unexpected(Error{ErrorCode::kInvalidInput, "not a valid BVH file: " + to_string(valid.error())});
  if (file.header->primitive_count > kMostPrimitives)
    return tl::unexpected(Error{
        ErrorCode::kTooLarge,
        std::to_string(file.header->primitive_count) + " primitives, the limit is " + std::to_string(kMostPrimitives)});
  return dispatch_layout(file.layout(), [&](auto layout) { return Exporter<decltype(layout)>(file).run(); });
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(out_of_memory({"to export a tree"}, failure));
}

}  // namespace hiprt::build
