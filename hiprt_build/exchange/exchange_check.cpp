#include <hiprt_build/exchange/exchange_check.h>

#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/format/bit_set.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/input/leaf.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace hiprt::build {
namespace {

/// References are numbered with 31 bits.
constexpr std::uint64_t kMaxEntries = std::uint64_t{1} << 31;
/// Homes keep a bit for themselves.
constexpr std::uint64_t kMaxNodes = std::uint64_t{CheckedTree::kShared};
constexpr std::uint64_t kReport = 4096;  ///< Steps between two looks at the monitor.

tl::unexpected<Error> wrong(std::string message) { return tl::unexpected(invalid(std::move(message))); }

std::string node_text(std::uint32_t node) { return "node " + std::to_string(node); }

std::string number_text(float value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", static_cast<double>(value));
  return text;
}

std::string range_text(std::uint64_t first, std::uint64_t count) {
  return "[" + std::to_string(first) + ", " + std::to_string(first + count) + ")";
}

/// The first side on which @p inner leaves @p outer: "min x -1 is outside of -0.5"; empty if it is inside.
std::string outside_text(const Box& inner, const Box& outer) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool low = inner.min[axis] < outer.min[axis];
    if (!low && !(inner.max[axis] > outer.max[axis])) continue;
    return std::string(low ? "min " : "max ") + "xyz"[axis] + " " +
           number_text(low ? inner.min[axis] : inner.max[axis]) + " is outside of " +
           number_text(low ? outer.min[axis] : outer.max[axis]);
  }
  return {};
}

/// How much larger a leaf's box would have to be to hold a primitive. NaN where areas overflow.
float growth(const Box& leaf, const Box& primitive) { return half_area(unite(leaf, primitive)) - half_area(leaf); }

/// A primitive by its geometry and its number there.
struct LocalPrimitive {
  std::uint32_t geometry, primitive;
};

LocalPrimitive locate(const BuildInput& input, std::uint32_t primitive) {
  const std::uint32_t geometry = input.table().find(primitive);
  return {geometry, primitive - input.geometries[geometry].first};
}

DropReason drop_reason_of(const BuildInput& input, LocalPrimitive at) {
  const GeometryView& geometry = input.geometries[at.geometry];
  if (geometry.is_custom()) return drop_reason(geometry.box(at.primitive));
  TriangleCorners corners;
  return load_triangle(geometry, at.primitive, corners);
}

Box bounds_of(const BuildInput& input, std::uint32_t geometry, std::uint32_t primitive) {
  const LeafContents alone = LeafContents::make(0, input.is_custom(geometry) ? LeafContents::kCustom : 0, 0);
  return to_box(leaf_simd_box(input.table(), {primitive, alone}));
}

class TreeCheck {
 public:
  TreeCheck(CpuEngine& engine, const ExchangeBvh& tree, const BuildInput& input)
      : engine_(engine),
        tree_(tree),
        input_(input),
        reached_(tree.nodes.size()),
        used_(tree.primitives.size()),
        several_(input.primitive_count()) {
    result_.order = engine.allocate<std::uint32_t>(tree.nodes.size());
    result_.home = engine.allocate<std::uint32_t>(input.primitive_count());
    engine.fill(result_.home.span(), kInvalidId);
  }

  Result<CheckedTree> run() {
    engine_.monitor().start("check", 0.1, 2 * tree_.nodes.size());
    for (const auto step :
         {&TreeCheck::walk, &TreeCheck::check_all_used, &TreeCheck::check_leaves, &TreeCheck::check_all_held})
      if (auto good = (this->*step)(); !good) return tl::unexpected(good.error());
    find_shared_homes();
    return std::move(result_);
  }

 private:
  /// Depth first, every node once; fills order and, with the last leaf of each primitive, home.
  Result<void> walk() {
    if (tree_.nodes.empty()) return {};
    std::vector<std::uint32_t> open{0};
    reached_.insert(0);
    for (std::size_t count = 0; !open.empty(); ++count) {
      const std::uint32_t node = open.back();
      open.pop_back();
      result_.order[count] = node;
      if (auto good = check_node(node); !good) return good;
      const ExchangeNode& here = tree_.nodes[node];
      if (auto good = here.children == 0 ? enter_leaf(node) : enter_children(node); !good) return good;
      for (std::uint32_t i = here.children; i-- > 0;) open.push_back(here.first + i);
      tick();
    }
    return {};
  }

  Result<void> check_node(std::uint32_t node) const {
    const ExchangeNode& here = tree_.nodes[node];
    if (here.children != 0 && here.primitives != 0)
      return wrong(node_text(node) + " has both children (" + std::to_string(here.children) + ") and primitives (" +
                   std::to_string(here.primitives) + ")");
    if (here.children == 0 && here.primitives == 0)
      return wrong(node_text(node) + " has neither children nor primitives");
    if (here.children == 1 || here.children > kBranching)
      return wrong(node_text(node) + " has " + std::to_string(here.children) + " children, allowed are 2 to 4");
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float low = here.box.min[axis], high = here.box.max[axis];
      if (std::isfinite(low) && std::isfinite(high) && low <= high) continue;
      return wrong(node_text(node) + ": its box is from " + number_text(low) + " to " + number_text(high) + " in " +
                   "xyz"[axis] + ", which is no finite range");
    }
    return {};
  }

  Result<void> enter_children(std::uint32_t node) {
    const ExchangeNode& here = tree_.nodes[node];
    if (std::uint64_t{here.first} + here.children > tree_.nodes.size())
      return wrong(node_text(node) + ": its children are nodes " + range_text(here.first, here.children) +
                   ", but there are " + std::to_string(tree_.nodes.size()) + " nodes");
    for (std::uint32_t i = 0; i < here.children; ++i) {
      const std::uint32_t child = here.first + i;
      const std::string text = outside_text(tree_.nodes[child].box, here.box);
      if (!text.empty())
        return wrong(node_text(node) + ", child " + std::to_string(i) + " (" + node_text(child) +
                     "): its box leaves the parent's: " + text);
      if (reached_.insert(child))
        return wrong(node_text(node) + ", child " + std::to_string(i) + ": " + node_text(child) +
                     (child == 0 ? " is the root" : " is the child of two nodes"));
    }
    return {};
  }

  Result<void> enter_leaf(std::uint32_t node) {
    const ExchangeNode& here = tree_.nodes[node];
    if (std::uint64_t{here.first} + here.primitives > tree_.primitives.size())
      return wrong(node_text(node) + ": its primitives are entries " + range_text(here.first, here.primitives) +
                   ", but there are " + std::to_string(tree_.primitives.size()) + " entries");
    for (std::uint32_t i = 0; i < here.primitives; ++i)
      if (auto good = enter_primitive(node, here.first + i); !good) return good;
    return {};
  }

  Result<void> enter_primitive(std::uint32_t node, std::uint32_t entry) {
    const auto wrong_entry = [&](const std::string& what) {
      return wrong(node_text(node) + ", entry " + std::to_string(entry) + what);
    };
    if (used_.insert(entry)) return wrong_entry(" is in another leaf, too");
    const std::uint32_t primitive = tree_.primitives[entry];
    if (primitive >= input_.primitive_count())
      return wrong_entry(": primitive " + std::to_string(primitive) + ", but there are " +
                         std::to_string(input_.primitive_count()));
    std::uint32_t& home = result_.home[primitive];
    if (home == node) return wrong_entry(": primitive " + std::to_string(primitive) + " is in this leaf twice");
    if (home != kInvalidId) several_.insert(primitive);
    home = node;
    return {};
  }

  Result<void> check_all_used() {
    if (const auto node = reached_.first_absent(tree_.nodes.size()); node != tree_.nodes.size())
      return wrong(node_text(static_cast<std::uint32_t>(node)) + " is not reached from the root");
    if (const auto entry = used_.first_absent(tree_.primitives.size()); entry != tree_.primitives.size())
      return wrong("entry " + std::to_string(entry) + " of the primitives is in no leaf");
    return {};
  }

  /// Boxes of leaves hold their primitives; home becomes the best leaf.
  Result<void> check_leaves() {
    for (const std::uint32_t node : result_.order.span()) {
      tick();
      const ExchangeNode& here = tree_.nodes[node];
      for (std::uint32_t i = 0; i < here.primitives; ++i)
        if (auto good = check_primitive(node, tree_.primitives[here.first + i]); !good) return good;
    }
    return {};
  }

  Result<void> check_primitive(std::uint32_t node, std::uint32_t primitive) {
    const LocalPrimitive at = locate(input_, primitive);
    if (drop_reason_of(input_, at) != kKept) {
      result_.home[primitive] = kInvalidId;
      return {};
    }
    const Box& leaf = tree_.nodes[node].box;
    const Box bounds = bounds_of(input_, at.geometry, primitive);
    if (several_.test(primitive)) {
      input_.is_custom(at.geometry) ? choose_leaf(primitive, node, bounds)
                                    : result_.shared.push_back({primitive, node});
      return {};
    }
    const std::string text = outside_text(bounds, leaf);
    if (text.empty()) return {};
    return wrong(describe(input_, at.geometry, at.primitive) + "leaves the box of " + node_text(node) +
                 ", the only leaf that it is in: " + text);
  }

  /// Of the leaves that a custom primitive is in.
  void choose_leaf(std::uint32_t primitive, std::uint32_t node, const Box& bounds) {
    std::uint32_t& home = result_.home[primitive];
    const float here = growth(tree_.nodes[node].box, bounds), there = growth(tree_.nodes[home].box, bounds);
    if (here < there || (here == there && node < home)) home = node;
  }

  /// Homes of the triangles in several leaves.
  void find_shared_homes() {
    std::sort(result_.shared.begin(), result_.shared.end());
    std::vector<std::span<const SharedTriangle>> lists;
    for (std::size_t i = 0; i < result_.shared.size(); i += lists.back().size())
      lists.push_back(result_.leaves_of(result_.shared[i].primitive));
    const auto less = [](std::span<const SharedTriangle> a, std::span<const SharedTriangle> b) {
      return std::lexicographical_compare(
          a.begin(), a.end(), b.begin(), b.end(),
          [](const SharedTriangle& x, const SharedTriangle& y) { return x.leaf < y.leaf; });
    };
    std::stable_sort(lists.begin(), lists.end(), less);
    std::uint32_t first = 0;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      if (i == 0 || less(lists[i - 1], lists[i])) first = lists[i][0].primitive;
      result_.home[lists[i][0].primitive] = CheckedTree::kShared | first;
    }
  }

  Result<void> check_all_held() {
    for (std::uint32_t primitive = 0; primitive < input_.primitive_count(); ++primitive) {
      if (result_.home[primitive] != kInvalidId) continue;
      const LocalPrimitive at = locate(input_, primitive);
      if (drop_reason_of(input_, at) == kKept)
        return wrong(describe(input_, at.geometry, at.primitive) + "in no leaf (primitive " +
                     std::to_string(primitive) + " of all)");
    }
    return {};
  }

  void tick() {
    if (++ticks_ % kReport == 0) engine_.monitor().add(kReport);
  }

  CpuEngine& engine_;
  const ExchangeBvh& tree_;
  const BuildInput& input_;
  BitSet reached_, used_, several_;
  std::uint64_t ticks_ = 0;
  CheckedTree result_;
};

}  // namespace

Result<CheckedTree> check_tree(CpuEngine& engine, const ExchangeBvh& tree, const BuildInput& input) {
  const auto too_large = [](std::size_t count, const char* what, std::uint64_t limit) {
    return tl::unexpected(Error{ErrorCode::kTooLarge, "the tree has " + std::to_string(count) + what +
                                                          ", the limit is " + std::to_string(limit - 1)});
  };
  if (tree.nodes.size() >= kMaxNodes) return too_large(tree.nodes.size(), " nodes", kMaxNodes);
  if (tree.primitives.size() >= kMaxEntries) return too_large(tree.primitives.size(), " entries", kMaxEntries);
  return TreeCheck(engine, tree, input).run();
}

Result<void> validate(const ExchangeBvh& tree, const SceneInput& scene) {
  return run_cpu("check", 0, {}, [&](CpuEngine& engine) -> Result<void> {
    if (auto sizes = check_sizes(scene); !sizes) return sizes;
    const BuildInput input(scene);
    if (auto indices = check_indices(engine, input); !indices) return indices;
    if (auto checked = check_tree(engine, tree, input); !checked) return tl::unexpected(checked.error());
    return {};
  });
}

}  // namespace hiprt::build
