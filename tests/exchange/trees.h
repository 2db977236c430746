#pragma once
/// Exchange trees made by hand, without the library's builders.

#include <hiprt_build/exchange.h>
#include <tests/oracle/mesh.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <algorithm>

namespace hiprt::test {

using build::ExchangeBvh;
using build::ExchangeNode;

/// Boxes of all primitives in the exchange form's numbering. Dropped ones have the box of the point 0.
inline std::vector<Box> primitive_boxes(const std::vector<oracle::Mesh>& meshes, const std::vector<Box>& customs = {}) {
  std::vector<Box> boxes;
  for (const oracle::Mesh& mesh : meshes)
    for (const oracle::Triangle& t : mesh.triangles) {
      Box box{};
      for (unsigned axis = 0; axis < 3; ++axis) {
        const auto [low, high] =
            std::minmax({mesh.positions[t[0]][axis], mesh.positions[t[1]][axis], mesh.positions[t[2]][axis]});
        box.min[axis] = low;
        box.max[axis] = high;
      }
      boxes.push_back(box);
    }
  boxes.insert(boxes.end(), customs.begin(), customs.end());
  for (Box& box : boxes)
    for (unsigned axis = 0; axis < 3; ++axis)
      if (!std::isfinite(box.min[axis]) || !std::isfinite(box.max[axis]) || !(box.min[axis] <= box.max[axis])) box = {};
  return boxes;
}

inline Box box_over(const Box& a, const Box& b) {
  Box box{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::min(a.min[axis], b.min[axis]);
    box.max[axis] = std::max(a.max[axis], b.max[axis]);
  }
  return box;
}

struct TreeShape {
  unsigned branching = 2;  ///< Most children, 2 to 4.
  unsigned leaf = 1;       ///< Most primitives in a leaf.
};

/// A tree whose nodes sort their primitives along a random axis and split the list at random positions.
class RandomTree {
 public:
  RandomTree(const std::vector<Box>& boxes, const TreeShape& shape, std::uint64_t seed)
      : boxes_(boxes), shape_(shape), random_(seed) {
    for (std::uint32_t i = 0; i < boxes.size(); ++i) tree_.primitives.push_back(i);
    if (boxes.empty()) return;
    tree_.nodes.emplace_back();
    fill(0, 0, static_cast<std::uint32_t>(boxes.size()));
  }
  const ExchangeBvh& tree() const { return tree_; }

 private:
  void fill(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    if (end - begin <= shape_.leaf) {
      Box box = boxes_[tree_.primitives[begin]];
      for (std::uint32_t i = begin; i < end; ++i) box = box_over(box, boxes_[tree_.primitives[i]]);
      tree_.nodes[node] = ExchangeNode{box, begin, 0, end - begin};
      return;
    }
    const auto bounds = split_range(begin, end);
    const auto first = static_cast<std::uint32_t>(tree_.nodes.size());
    const auto children = static_cast<std::uint32_t>(bounds.size() - 1);
    tree_.nodes.resize(first + children);
    for (std::uint32_t i = 0; i < children; ++i) fill(first + i, bounds[i], bounds[i + 1]);
    Box box = tree_.nodes[first].box;
    for (std::uint32_t i = 1; i < children; ++i) box = box_over(box, tree_.nodes[first + i].box);
    tree_.nodes[node] = ExchangeNode{box, first, children, 0};
  }

  /// Ends of the children's lists: begin, ..., end.
  std::vector<std::uint32_t> split_range(std::uint32_t begin, std::uint32_t end) {
    const unsigned axis = random_.below(3);
    std::stable_sort(tree_.primitives.begin() + begin, tree_.primitives.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return boxes_[a].min[axis] + boxes_[a].max[axis] < boxes_[b].min[axis] + boxes_[b].max[axis];
                     });
    std::vector<std::uint32_t> bounds{begin, end};
    const unsigned wanted = 2 + random_.below(shape_.branching - 1);
    for (unsigned i = 1; i < wanted; ++i) bounds.push_back(begin + 1 + random_.below(end - begin - 1));
    std::sort(bounds.begin(), bounds.end());
    bounds.erase(std::unique(bounds.begin(), bounds.end()), bounds.end());
    return bounds;
  }

  const std::vector<Box>& boxes_;
  TreeShape shape_;
  oracle::Random random_;
  ExchangeBvh tree_;
};

inline ExchangeBvh random_tree(const std::vector<Box>& boxes, const TreeShape& shape, std::uint64_t seed) {
  return RandomTree(boxes, shape, seed).tree();
}

/// As deep as can be: every node has a leaf and the rest.
inline ExchangeBvh chain_tree(const std::vector<Box>& boxes) {
  const auto count = static_cast<std::uint32_t>(boxes.size());
  ExchangeBvh tree;
  tree.nodes.resize(2 * count - 1);
  Box box = boxes.back();
  for (std::uint32_t i = count; i-- > 0;) {
    const ExchangeNode leaf{boxes[i], i, 0, 1};
    box = box_over(box, boxes[i]);
    // Node 2 i - 1 is the leaf of primitive i - 1, node 2 i the rest.
    if (i + 1 == count) {
      tree.nodes[2 * i] = leaf;
    } else {
      tree.nodes[2 * i + 1] = leaf;
      tree.nodes[2 * i] = ExchangeNode{box, 2 * i + 1, 2, 0};
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) tree.primitives.push_back(i);
  return tree;
}

inline bool same(const ExchangeBvh& a, const ExchangeBvh& b) {
  const auto same_node = [](const ExchangeNode& x, const ExchangeNode& y) {
    return std::equal(x.box.min, x.box.min + 3, y.box.min) && std::equal(x.box.max, x.box.max + 3, y.box.max) &&
           x.first == y.first && x.children == y.children && x.primitives == y.primitives;
  };
  return std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(), same_node) &&
         a.primitives == b.primitives;
}

}  // namespace hiprt::test
