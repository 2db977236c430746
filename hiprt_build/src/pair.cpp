#include <hiprt_build/steps/edges.h>
#include <hiprt_build/steps/pair.h>

#include <cmath>

namespace hiprt::build {
namespace {

enum Fate : std::uint8_t { kKept = 0, kNotFinite = 1, kDegenerate = 2 };

struct ClassifyStep {
  const TriangleMesh& mesh;
  std::span<std::uint8_t> fate;

  void operator()(std::size_t i) const {
    const Position& a = mesh.positions[mesh.triangles[i][0]];
    const Position& b = mesh.positions[mesh.triangles[i][1]];
    const Position& c = mesh.positions[mesh.triangles[i][2]];
    bool finite = true;
    for (unsigned axis = 0; axis < 3; ++axis)
      finite = finite && std::isfinite(a[axis]) && std::isfinite(b[axis]) && std::isfinite(c[axis]);
    fate[i] = !finite ? kNotFinite : a == b || b == c || c == a ? kDegenerate : kKept;
  }
};

/// Step: the edge across which triangle i would like to pair, 0-2, or kNone.
struct ChooseStep {
  static constexpr std::uint8_t kNone = 3;
  const TriangleMesh& mesh;
  std::span<const HalfEdge> partner;
  std::span<const HalfEdge> mate;
  std::span<std::uint8_t> choice;

  void operator()(std::size_t i) const {
    choice[i] = kNone;
    if (mate[i] != kInvalidId) return;
    float best_gain = 0.0f;
    HalfEdge best_edge = kInvalidId;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const HalfEdge other = partner[3 * i + k];
      if (other == kInvalidId || mate[other >> 2] != kInvalidId) continue;
      const float gain = shared_area_gain(mesh, static_cast<std::uint32_t>(i), other >> 2);
      const HalfEdge edge = std::min(static_cast<HalfEdge>(4 * i + k), other);
      if (gain > best_gain || (gain == best_gain && edge < best_edge && gain > 0.0f)) {
        best_gain = gain;
        best_edge = edge;
        choice[i] = k;
      }
    }
  }
};

/// Step: pairs triangle i with the one it chose if that chose the same edge.
struct ShakeHandsStep {
  std::span<const HalfEdge> partner;
  std::span<const std::uint8_t> choice;
  std::span<HalfEdge> mate;  ///< The half-edge of the other triangle, or kInvalidId.

  void operator()(std::size_t i) const {
    if (choice[i] == ChooseStep::kNone) return;
    const HalfEdge other = partner[3 * i + choice[i]];
    const std::size_t t = other >> 2;
    if (choice[t] == (other & 3u) && partner[3 * t + choice[t]] == 4 * i + choice[i]) mate[i] = other;
  }
};

constexpr int kRounds = 6;

/// Mates of a mesh's triangles (half-edge of the other triangle), kInvalidId for single ones.
ScratchArray<HalfEdge> match_triangles(CpuEngine& engine, const TriangleMesh& mesh, std::span<const std::uint8_t> fate,
                                       bool pair_triangles) {
  auto mate = engine.allocate<HalfEdge>(mesh.triangles.size());
  engine.fill(mate.span(), kInvalidId);
  if (!pair_triangles) return mate;
  const auto partner = find_partners(engine, mesh, fate);
  auto choice = engine.allocate<std::uint8_t>(mesh.triangles.size());
  for (int round = 0; round < kRounds; ++round) {
    engine.for_each(mesh.triangles.size(), ChooseStep{mesh, partner.span(), mate.span(), choice.span()});
    engine.for_each(mesh.triangles.size(), ShakeHandsStep{partner.span(), choice.span(), mate.span()});
  }
  return mate;
}

/// The group in which triangle i is the lower one. @p other kInvalidId or a half-edge of the second triangle.
PrimitiveGroup make_group(const TriangleMesh& mesh, std::uint32_t mesh_index, std::uint32_t i, HalfEdge other) {
  PrimitiveGroup group{{i, kInvalidId}, mesh_index & kGeometryMask, 0, 0};
  if (other == kInvalidId) return group;
  // Edge b of the second triangle runs from v2 to v1; the first one's shared edge from v1 to v2.
  const std::uint32_t second = other >> 2, b = other & 3u;
  const Position& v2 = mesh.positions[mesh.triangles[second][b]];
  const Position& v1 = mesh.positions[mesh.triangles[second][(b + 1) % 3]];
  for (std::uint32_t a = 0; a < 3; ++a) {
    if (mesh.positions[mesh.triangles[i][a]] != v1 || mesh.positions[mesh.triangles[i][(a + 1) % 3]] != v2) continue;
    group.primitive[1] = second;
    group.rotation0 = (a + 2) % 3 & 3u;
    group.rotation1 = (b + 1) % 3 & 3u;
  }
  return group;
}

/// Step: what becomes of custom primitive i.
struct ClassifyBoxStep {
  std::span<const Box> boxes;
  std::span<std::uint8_t> fate;

  void operator()(std::size_t i) const {
    const Box& box = boxes[i];
    bool finite = true, ordered = true;
    for (unsigned axis = 0; axis < 3; ++axis) {
      finite = finite && std::isfinite(box.min[axis]) && std::isfinite(box.max[axis]);
      ordered = ordered && box.min[axis] <= box.max[axis];
    }
    fate[i] = !finite ? kNotFinite : !ordered ? kDegenerate : kKept;
  }
};

bool share_leaf(const Box& first, const Box& second) {
  const Aabb a = to_aabb(first), b = to_aabb(second);
  Aabb both = a;
  both.add(b);
  return half_area(both) <= kCustomPairArea * (half_area(a) + half_area(b));
}

/// Appends groups to a result.
class Grouping {
 public:
  explicit Grouping(GroupedPrimitives& result) : result_(result) {}

  /// Counts a primitive that is dropped. @return whether it is kept.
  bool keep(std::size_t geometry, std::uint8_t fate) {
    result_.dropped_not_finite += fate == kNotFinite ? 1 : 0;
    result_.dropped_degenerate += fate == kDegenerate ? 1 : 0;
    result_.dropped[geometry] += fate != kKept ? 1 : 0;
    return fate == kKept;
  }
  void add(const PrimitiveGroup& group) {
    result_.groups[result_.count++] = group;
    result_.custom_count += group.is_custom() ? 1 : 0;
    if (group.is_pair()) ++(group.is_custom() ? result_.custom_pairs : result_.pairs);
  }

 private:
  GroupedPrimitives& result_;
};

void group_mesh(CpuEngine& engine, const TriangleMesh& mesh, std::uint32_t geometry, bool pair, Grouping& grouping) {
  auto fate = engine.allocate<std::uint8_t>(mesh.triangles.size());
  engine.for_each(mesh.triangles.size(), ClassifyStep{mesh, fate.span()});
  const auto mate = match_triangles(engine, mesh, fate.span(), pair);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (grouping.keep(geometry, fate[i]) && (mate[i] == kInvalidId || mate[i] >> 2 > i))
      grouping.add(make_group(mesh, geometry, i, mate[i]));
  }
}

void group_customs(CpuEngine& engine, const CustomGeometry& custom, std::uint32_t geometry, bool pair,
                   Grouping& grouping) {
  const auto boxes = custom.boxes;
  auto fate = engine.allocate<std::uint8_t>(boxes.size());
  engine.for_each(boxes.size(), ClassifyBoxStep{boxes, fate.span()});
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (!grouping.keep(geometry, fate[i])) continue;
    PrimitiveGroup group{{i, kInvalidId}, geometry & kGeometryMask, PrimitiveGroup::kCustom, 0};
    const bool has_next = i % 2 == 0 && i + 1 < boxes.size() && fate[i + 1] == kKept;
    if (pair && has_next && share_leaf(boxes[i], boxes[i + 1])) group.primitive[1] = ++i;
    grouping.add(group);
  }
}

}  // namespace

GroupedPrimitives group_primitives(CpuEngine& engine, const PrimitiveSoup& soup, bool pair) {
  GroupedPrimitives result;
  result.dropped.resize(soup.geometries());
  result.groups = engine.allocate<PrimitiveGroup>(soup.size());
  engine.monitor().start("pair", 0.3, soup.size() * (pair ? 3 + 2 * kRounds : 1));
  Grouping grouping(result);
  for (std::size_t m = 0; m < soup.meshes.size(); ++m)
    group_mesh(engine, soup.meshes[m], static_cast<std::uint32_t>(m), pair, grouping);
  for (std::size_t c = 0; c < soup.customs.size(); ++c)
    group_customs(engine, soup.customs[c], static_cast<std::uint32_t>(soup.meshes.size() + c), pair, grouping);
  return result;
}

}  // namespace hiprt::build
