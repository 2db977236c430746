#include <hiprt_build/host/host_nodes.h>

#include <hiprt_build/format/box.h>

#include <algorithm>
#include <array>
#include <limits>

namespace hiprt::format_detail {
namespace {

/// Levels of a tree that are followed: builders make fewer.
constexpr unsigned kMostLevels = 256;
/// In visits of a node.
constexpr float kLeavesCost = 0.3f, kTwoLeavesCost = 0.7f;

/// A subtree shown as at most n children of a wide node, n = 1 to 8.
struct Forms {
  Box box;
  std::array<float, kWideBranching + 1> cost;  ///< By n; [0] is not used.
  std::uint64_t first = 0;                     ///< Offset of the first leaf, if leaves is not 0.
  unsigned leaves = 0;                         ///< Leaves side by side below, up to kMostWideLeaves; 0: more, or apart.
};

/// The binary tree over a node's children. Items 0 to 3 are the children, item 4 + i is the i-th pair.
struct Plan {
  static constexpr unsigned kPairs = kBranching - 1;

  std::array<std::uint8_t, kPairs> left{}, right{};  ///< Items of a pair. Without pairs left[0] is the only child.
  std::uint8_t pairs = 0;
  std::uint8_t runs = 0;  ///< Bit i: pair i is shown as leaves where it is one child.
  /// Three bits per n = 2 to 8: how many children come from the left; 0: as with n - 1.
  std::array<std::uint32_t, kPairs> share{};

  unsigned from_left(unsigned pair, unsigned n) const { return share[pair] >> (3 * (n - 2)) & 7u; }
  void set_from_left(unsigned pair, unsigned n, unsigned value) { share[pair] |= value << (3 * (n - 2)); }
  bool is_run(unsigned pair) const { return (runs >> pair & 1u) != 0; }
  /// The item that stands for the node.
  unsigned top() const { return pairs == 0 ? left[0] : kBranching + pairs - 1u; }
};

float leaves_cost(float area, unsigned leaves) {
  const unsigned tests = (leaves + 1) / 2;
  return area * (kLeavesCost + kTwoLeavesCost * static_cast<float>(tests));
}

class Maker {
 public:
  explicit Maker(const BufferView& file) : file_(file), nodes_(file.node_array<PlanesBoxNode>()) {}

  HostNodes make() {
    plans_.resize(file_.node_count());
    const std::uint32_t root = number(file_.header->root);
    plan(root, 1);
    if (is_too_deep_) return {};
    made_.reserve(file_.node_count() / 3 + 1);
    if (emit({root, plans_[root].top()}) + kWideBranching - 1 > kHostStack) return {};
    for (HostNode& node : made_)
      for (HostRef& child : node.child)
        if (child.is_node()) child = HostRef(made_.data() + child.number());
    return std::move(made_);
  }

 private:
  /// An item of a node.
  struct Item {
    std::uint32_t node;
    unsigned item;
  };
  /// A child of a wide node: leaves, or an item that becomes a wide node.
  struct Child {
    Box box;
    HostRef leaves;  ///< None: a node.
    Item below;
  };
  struct Children {
    std::array<Child, kWideBranching> child;
    unsigned count = 0;
  };

  std::uint32_t number(NodeRef ref) const { return static_cast<std::uint32_t>(file_.node_number(ref)); }
  const PlanesLeaf& leaf(std::uint64_t offset) const {
    return *reinterpret_cast<const PlanesLeaf*>(file_.bytes.data() + offset);
  }
  unsigned run_length(NodeRef ref) const {
    unsigned count = 1;
    for (std::uint64_t at = ref_offset(ref); (leaf(at).info.geometry_and_flags & kLastInRun) == 0;
         at += sizeof(PlanesLeaf))
      ++count;
    return count;
  }

  Forms plan_child(NodeRef ref, const Box& box, unsigned level) {
    if (is_box(ref)) {
      Forms forms = plan(number(ref), level + 1);
      forms.box = box;
      return forms;
    }
    const unsigned length = run_length(ref);
    Forms forms;
    forms.box = box;
    forms.cost.fill(leaves_cost(half_area(box), length));
    forms.first = ref_offset(ref);
    forms.leaves = length <= kMostWideLeaves ? length : 0;
    return forms;
  }

  /// Fills the plans of a subtree.
  Forms plan(std::uint32_t at, unsigned level) {
    if (level > kMostLevels) {
      is_too_deep_ = true;
      return {};
    }
    std::array<Forms, kBranching + Plan::kPairs> forms;
    std::array<unsigned, kBranching> open{};
    unsigned count = 0;
    for (unsigned c = 0; c < kBranching; ++c) {
      if (nodes_[at].child[c] == kInvalidRef) continue;
      forms[c] = plan_child(nodes_[at].child[c], PlanesLayout::box(nodes_[at], c), level);
      open[count++] = c;
    }
    Plan& plan = plans_[at];
    unsigned top = open[0];
    for (; count > 1; --count) {
      unsigned i = 0, k = 1;
      float least = std::numeric_limits<float>::infinity();
      for (unsigned a = 0; a < count; ++a)
        for (unsigned b = a + 1; b < count; ++b)
          if (const float area = half_area(unite(forms[open[a]].box, forms[open[b]].box)); area < least) {
            least = area;
            i = a;
            k = b;
          }
      unsigned left = open[i], right = open[k];
      // Leaves that lie side by side must come in order.
      if (forms[right].first < forms[left].first) std::swap(left, right);
      const unsigned pair = plan.pairs++;
      top = kBranching + pair;
      plan.left[pair] = static_cast<std::uint8_t>(left);
      plan.right[pair] = static_cast<std::uint8_t>(right);
      forms[top] = join(plan, pair, forms[left], forms[right]);
      open[i] = top;
      open[k] = open[count - 1];
    }
    if (plan.pairs == 0) plan.left[0] = static_cast<std::uint8_t>(top);
    return forms[top];
  }

  static Forms join(Plan& plan, unsigned pair, const Forms& left, const Forms& right) {
    Forms forms;
    forms.box = unite(left.box, right.box);
    const float area = half_area(forms.box);
    if (left.leaves != 0 && right.leaves != 0 && left.leaves + right.leaves <= kMostWideLeaves &&
        left.first + left.leaves * sizeof(PlanesLeaf) == right.first) {
      forms.first = left.first;
      forms.leaves = left.leaves + right.leaves;
    }
    std::array<float, kWideBranching + 1> split{};  ///< Least cost of n children, some from either side.
    std::array<unsigned, kWideBranching + 1> from_left{};
    for (unsigned n = 2; n <= kWideBranching; ++n) {
      split[n] = left.cost[1] + right.cost[n - 1];
      from_left[n] = 1;
      for (unsigned k = 2; k < n; ++k)
        if (const float cost = left.cost[k] + right.cost[n - k]; cost < split[n]) {
          split[n] = cost;
          from_left[n] = k;
        }
    }
    forms.cost[1] = area + split[kWideBranching];
    if (forms.leaves != 0)
      if (const float cost = leaves_cost(area, forms.leaves); cost <= forms.cost[1]) {
        forms.cost[1] = cost;
        plan.runs = static_cast<std::uint8_t>(plan.runs | 1u << pair);
      }
    for (unsigned n = 2; n <= kWideBranching; ++n) {
      const bool splits = n == kWideBranching || split[n] < forms.cost[n - 1];
      // The node's own children, form 8, are always both sides' children.
      forms.cost[n] = std::min(split[n], forms.cost[n - 1]);
      if (splits) plan.set_from_left(pair, n, from_left[n]);
    }
    return forms;
  }

  /// The same item, in the child node if it is one.
  Item resolve(Item at) const {
    while (at.item < kBranching && is_box(nodes_[at.node].child[at.item])) {
      at.node = number(nodes_[at.node].child[at.item]);
      at.item = plans_[at.node].top();
    }
    return at;
  }
  Box box_of(Item at) const {
    if (at.item < kBranching) return PlanesLayout::box(nodes_[at.node], at.item);
    const Plan& plan = plans_[at.node];
    const unsigned pair = at.item - kBranching;
    return unite(box_of({at.node, plan.left[pair]}), box_of({at.node, plan.right[pair]}));
  }
  struct Leaves {
    std::uint64_t first;
    unsigned count;
  };
  Leaves leaves_of(Item at) const {
    at = resolve(at);
    if (at.item < kBranching) {
      const NodeRef ref = nodes_[at.node].child[at.item];
      return {ref_offset(ref), run_length(ref)};
    }
    const Plan& plan = plans_[at.node];
    const unsigned pair = at.item - kBranching;
    const Leaves left = leaves_of({at.node, plan.left[pair]}), right = leaves_of({at.node, plan.right[pair]});
    return {left.first, left.count + right.count};
  }
  HostRef leaves_ref(const Leaves& leaves) const {
    const PlanesLeaf* first = &leaf(leaves.first);
    return leaves.count <= kMostWideLeaves ? HostRef(first, leaves.count) : HostRef::long_run(first);
  }

  /// Adds the children as which an item is shown.
  /// @param most children.
  void show(Item at, unsigned most, Children& children) const {
    at = resolve(at);
    if (at.item < kBranching) {
      children.child[children.count++] = {box_of(at), leaves_ref(leaves_of(at)), at};
      return;
    }
    const Plan& plan = plans_[at.node];
    const unsigned pair = at.item - kBranching;
    while (most > 1 && plan.from_left(pair, most) == 0) --most;
    if (most > 1)
      show_parts(at, most, children);
    else
      children.child[children.count++] = {box_of(at), plan.is_run(pair) ? leaves_ref(leaves_of(at)) : HostRef::none(),
                                          at};
  }
  /// @pre the item is a pair whose plan for @p most children splits it
  void show_parts(Item at, unsigned most, Children& children) const {
    const Plan& plan = plans_[at.node];
    const unsigned pair = at.item - kBranching, from_left = plan.from_left(pair, most);
    show({at.node, plan.left[pair]}, from_left, children);
    show({at.node, plan.right[pair]}, most - from_left, children);
  }

  /// Makes the wide node of an item, and those below.
  /// @return stack entries that a traversal of it can need.
  unsigned emit(Item at) {
    Children children;
    at = resolve(at);
    if (at.item < kBranching)
      show(at, 1, children);
    else
      show_parts(at, kWideBranching, children);
    const std::size_t here = made_.size();
    made_.emplace_back();
    HostNode node;
    unsigned need = 0;
    for (unsigned c = 0; c < kWideBranching; ++c) {
      const bool exists = c < children.count;
      const Box box = exists ? children.child[c].box : empty_box();
      for (unsigned axis = 0; axis < 3; ++axis) {
        node.plane[axis][0][c] = box.min[axis];
        node.plane[axis][1][c] = box.max[axis];
      }
      node.child[c] = exists ? children.child[c].leaves : HostRef::none();
      if (!exists || !node.child[c].is_none()) continue;
      // A number until all nodes are made.
      node.child[c] = HostRef::numbered(made_.size());
      need = std::max(need, emit(children.child[c].below));
    }
    made_[here] = node;
    return need + children.count - 1;
  }

  BufferView file_;
  NodeArray<const PlanesBoxNode> nodes_;
  std::vector<Plan> plans_;
  HostNodes made_;
  bool is_too_deep_ = false;
};

}  // namespace

HostNodes make_host_nodes(const BufferView& file) {
  const FeatureMask features =
      feature_bit(Feature::kTriangles) | feature_bit(Feature::kMasks) | feature_bit(Feature::kSplitReferences);
  if (file.layout() != NodeLayout::kPlanes || (file.header->features & ~features) != 0 || !is_box(file.header->root))
    return {};
  return Maker(file).make();
}

}  // namespace hiprt::format_detail
