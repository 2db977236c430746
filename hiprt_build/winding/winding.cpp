#include <hiprt_build/exec/threads.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/winding.h>
#include <hiprt_build/winding/winding_walk.h>

#include <algorithm>
#include <cmath>

namespace hiprt::build {
namespace {

/// Covers the rounding of areas and lengths.
constexpr double kOutwards = 1.0 + 0x1p-40;
/// The radius of larger parts comes from the parts below: to look at every corner for each would take too long in deep
/// trees.
constexpr std::uint32_t kLookedAt = 4096;

struct Vector {
  double x, y, z;
};

Vector corner(const WindingTriangle& t, int k) { return {t.corner[k][0], t.corner[k][1], t.corner[k][2]}; }
Vector minus(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double length(const Vector& a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }
Vector center_of(const WindingNode& node) { return {node.center[0], node.center[1], node.center[2]}; }

/// What a triangle or a part is from afar.
struct Moment {
  Vector at;      ///< Centroid, or center of the part.
  Vector dipole;  ///< Area times normal.
  double area;
  const double* spread;  ///< Of the part; nullptr: a triangle has none.
};

Moment moment_of(const WindingTriangle& t) {
  const Vector a = corner(t, 0), b = corner(t, 1), c = corner(t, 2), p = minus(b, a), q = minus(c, a);
  const Vector normal{0.5 * (p.y * q.z - p.z * q.y), 0.5 * (p.z * q.x - p.x * q.z), 0.5 * (p.x * q.y - p.y * q.x)};
  return {{(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3}, normal, length(normal), nullptr};
}

Moment moment_of(const WindingNode& node) {
  return {center_of(node), {node.dipole[0], node.dipole[1], node.dipole[2]}, node.area, node.spread};
}

/// Calls visit(Moment) for what a node consists of.
template <class Visit> void for_each_moment(const WindingArrays& arrays, std::uint32_t i, const Visit& visit) {
  const WindingNode& node = arrays.nodes[i];
  if (node.next == i + 1)
    for (std::uint32_t k = 0; k < node.count; ++k) visit(moment_of(arrays.triangles[node.first + k]));
  else
    for (std::uint32_t child = i + 1; child < node.next; child = arrays.nodes[child].next)
      visit(moment_of(arrays.nodes[child]));
}

/// @pre the parts below have theirs.
void set_moments(WindingArrays& arrays, std::uint32_t i) {
  double area = 0;
  Vector sum{};
  for_each_moment(arrays, i, [&](const Moment& m) {
    area += m.area;
    sum = {sum.x + m.area * m.at.x, sum.y + m.area * m.at.y, sum.z + m.area * m.at.z};
  });
  const Vector any = corner(arrays.triangles[arrays.nodes[i].first], 0);
  const Vector center = area > 0 ? Vector{sum.x / area, sum.y / area, sum.z / area} : any;
  WindingNode node = arrays.nodes[i];
  for_each_moment(arrays, i, [&](const Moment& m) {
    const Vector off = minus(m.at, center), n = m.dipole;
    const double dipole[3] = {n.x, n.y, n.z};
    const double spread[6] = {off.x * n.x,
                              off.y * n.y,
                              off.z * n.z,
                              0.5 * (off.y * n.z + off.z * n.y),
                              0.5 * (off.z * n.x + off.x * n.z),
                              0.5 * (off.x * n.y + off.y * n.x)};
    for (unsigned k = 0; k < 3; ++k) node.dipole[k] += dipole[k];
    for (unsigned k = 0; k < 6; ++k) node.spread[k] += spread[k] + (m.spread != nullptr ? m.spread[k] : 0.0);
  });
  node.area = area;
  node.center[0] = center.x;
  node.center[1] = center.y;
  node.center[2] = center.z;
  arrays.nodes[i] = node;
}

/// The largest distance of a corner from the center.
double radius_of_corners(const WindingArrays& arrays, const WindingNode& node) {
  double radius = 0;
  for (std::uint32_t k = node.first; k < node.first + node.count; ++k)
    for (int c = 0; c < 3; ++c)
      radius = std::max(radius, length(minus(corner(arrays.triangles[k], c), center_of(node))));
  return radius * kOutwards;
}

double radius_of_parts(const WindingArrays& arrays, std::uint32_t i) {
  double radius = 0;
  for (std::uint32_t child = i + 1; child < arrays.nodes[i].next; child = arrays.nodes[child].next) {
    const WindingNode& part = arrays.nodes[child];
    radius = std::max(radius, part.radius + length(minus(center_of(part), center_of(arrays.nodes[i]))));
  }
  return radius * kOutwards;
}

void set_all_moments(WindingArrays& arrays) {
  std::vector<WindingNode>& nodes = arrays.nodes;
  for (auto i = static_cast<std::uint32_t>(nodes.size()); i-- > 0;) set_moments(arrays, i);
  const auto is_looked_at = [&](std::size_t i) {
    return nodes[i].count <= kLookedAt || nodes[i].next == static_cast<std::uint32_t>(i) + 1;
  };
  constexpr std::size_t kBlock = 256;
  Threads::for_each((nodes.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(nodes.size(), (block + 1) * kBlock); ++i)
      if (is_looked_at(i)) nodes[i].radius = radius_of_corners(arrays, nodes[i]);
  });
  for (auto i = static_cast<std::uint32_t>(nodes.size()); i-- > 0;)
    if (!is_looked_at(i)) nodes[i].radius = radius_of_parts(arrays, i);
  for (WindingNode& node : nodes) node.area *= kOutwards;
}

}  // namespace

Result<WindingArrays> winding_arrays(const BufferView& view, std::uint32_t mask, unsigned threads) {
  const auto refuse = [](const char* what) {
    return tl::unexpected(
        Error{ErrorCode::kInvalidInput, std::string("winding numbers are those of one mesh: ") + what});
  };
  if (view.has_instances())
    return refuse("this file has instances. Build it without them, or ask each object at the point in its space");
  if ((view.header->features & feature_bit(Feature::kCustom)) != 0)
    return refuse("this file has custom primitives. Build a file of the triangles alone");
  if (view.header->primitive_count > kInvalidId)
    return tl::unexpected(Error{ErrorCode::kTooLarge, std::to_string(view.header->primitive_count) +
                                                          " triangles, winding numbers take 4294967295"});
  return or_out_of_memory("for winding numbers", [&]() -> Result<WindingArrays> {
    WindingArrays arrays =
        dispatch_layout(view.layout(), [&](auto layout) { return WindingWalk<decltype(layout)>(view, mask).run(); });
    Threads::run(threads, [&] { set_all_moments(arrays); });
    return arrays;
  });
}

}  // namespace hiprt::build
