#include <tools/render/parts/part_router.h>

#include <hiprt_build/format/box.h>
#include <hiprt_device/hiprt_device.h>

#include <algorithm>
#include <array>
#include <limits>

namespace hiprt::tools {
namespace {

using format_detail::empty_box;
using format_detail::grow;

// References in the tree: nodes are even, parts odd.
constexpr NodeRef ref_of_node(std::size_t node) { return static_cast<NodeRef>(2 * node); }
constexpr NodeRef ref_of_part(std::uint32_t part) { return 2 * part + 1; }
constexpr bool is_part(NodeRef ref) { return (ref & 1u) != 0; }

}  // namespace

PartRouter::PartRouter(std::span<const ScenePart> parts) : parts_(parts.size()) {
  std::vector<Item> items;
  for (std::uint32_t i = 0; i < parts.size(); ++i) {
    const ScenePart& part = parts[i];
    if (part.boxes.empty()) continue;
    if (items.empty()) bounds_ = part.bounds;
    grow(bounds_, part.bounds);
    condition_ = std::max(condition_, part.condition);
    reach_ = std::max(reach_, part.reach);
    for (const Box& box : part.boxes) items.push_back({box, i});
  }
  if (!items.empty()) root_ = build(items);
}

NodeRef PartRouter::build(std::span<Item> items) {
  if (items.size() == 1) return ref_of_part(items[0].part);
  // Halves at the median along the longest axis.
  const auto halves = [](std::span<Item> of) {
    Box centers = empty_box();
    const auto center = [](const Item& item, unsigned axis) {
      return 0.5f * item.box.min[axis] + 0.5f * item.box.max[axis];
    };
    for (const Item& item : of) {
      const Box at{{center(item, 0), center(item, 1), center(item, 2)},
                   {center(item, 0), center(item, 1), center(item, 2)}};
      grow(centers, at);
    }
    unsigned longest = 0;
    for (unsigned axis = 1; axis < 3; ++axis)
      if (centers.max[axis] - centers.min[axis] > centers.max[longest] - centers.min[longest]) longest = axis;
    const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
    std::nth_element(of.begin(), middle, of.end(),
                     [&](const Item& a, const Item& b) { return center(a, longest) < center(b, longest); });
    return std::array{of.first(of.size() / 2), of.subspan(of.size() / 2)};
  };
  std::array<std::span<Item>, kBranching> children{};
  std::size_t count = 0;
  for (const std::span<Item>& half : halves(items)) {
    if (half.size() == 1) {
      children[count++] = half;
      continue;
    }
    for (const std::span<Item>& quarter : halves(half)) children[count++] = quarter;
  }
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  for (unsigned i = 0; i < kBranching; ++i) {
    Box box = empty_box();
    for (const Item& item : children[i]) grow(box, item.box);
    const NodeRef child = i < count ? build(children[i]) : kInvalidRef;
    PlanesLayout::set_box(nodes_[node], i, box);
    nodes_[node].child[i] = child;
  }
  return ref_of_node(node);
}

void PartRouter::route(const Ray& ray, std::vector<PartVisit>& visits) const {
  if (root_ == kInvalidRef || !is_traceable(ray)) return;
  const std::size_t first = visits.size();
  const auto add = [&](std::uint32_t part, float enter) {
    const auto known = std::find_if(visits.begin() + static_cast<std::ptrdiff_t>(first), visits.end(),
                                    [&](const PartVisit& visit) { return visit.part == part; });
    if (known == visits.end())
      visits.push_back({part, enter});
    else
      known->enter = std::min(known->enter, enter);
  };
  const float tmin = std::max(ray.tmin, 0.0f), tmax = std::min(ray.tmax, std::numeric_limits<float>::max());
  // A single box has no node.
  if (is_part(root_)) return add(root_ / 2, tmin);
  using Lanes = DefaultLanes;
  const RaySlabs<Lanes> slabs(ray, Conservative::margin(ray.origin, bounds_, condition_, reach_));
  // A tree of quarters over kMostParts * kMostPartBoxes boxes has 11 levels.
  std::array<NodeRef, 64> stack;
  std::size_t size = 0;
  for (NodeRef ref = root_;;) {
    const PlanesBoxNode& node = nodes_[ref / 2];
    const BoxHits<Lanes> hits = intersect_boxes<Lanes>(node, slabs, Lanes::uniform(tmin), Lanes::uniform(tmax));
    for (unsigned i = 0; i < kBranching; ++i) {
      if (!hits.hit(i)) continue;
      if (is_part(node.child[i]))
        add(node.child[i] / 2, Lanes::get(hits.enter, i));
      else
        stack[size++] = node.child[i];
    }
    if (size == 0) break;
    ref = stack[--size];
  }
  std::sort(
      visits.begin() + static_cast<std::ptrdiff_t>(first), visits.end(),
      [](const PartVisit& a, const PartVisit& b) { return a.enter != b.enter ? a.enter < b.enter : a.part < b.part; });
}

}  // namespace hiprt::tools
