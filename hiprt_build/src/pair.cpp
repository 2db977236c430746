#include <hiprt_build/steps/custom_pair.h>
#include <hiprt_build/steps/edges.h>
#include <hiprt_build/steps/pair.h>

namespace hiprt::build {
namespace {

/// Step: what becomes of triangle i.
struct ClassifyStep {
  const TriangleMesh& mesh;
  std::span<std::uint8_t> fate;

  void operator()(std::size_t i) const { fate[i] = triangle_fate(mesh, i); }
};

/// Step: triangle i has no partners in other homes.
struct StayHomeStep {
  std::span<const std::uint32_t> home;
  std::span<HalfEdge> partner;

  void operator()(std::size_t i) const {
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      if (partner[k] != kInvalidId && home[partner[k] >> 2] != home[i]) partner[k] = kInvalidId;
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
/// @param home of the mesh's triangles, or empty.
ScratchArray<HalfEdge> match_triangles(CpuEngine& engine, const TriangleMesh& mesh, std::span<const std::uint8_t> fate,
                                       bool pair_triangles, std::span<const std::uint32_t> home) {
  auto mate = engine.allocate<HalfEdge>(mesh.triangles.size());
  engine.fill(mate.span(), kInvalidId);
  if (!pair_triangles) return mate;
  auto partner = find_partners(engine, mesh, fate);
  if (!home.empty()) engine.for_each(mesh.triangles.size(), StayHomeStep{home, partner.span()});
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

  void operator()(std::size_t i) const { fate[i] = box_fate(boxes[i]); }
};

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

void group_mesh(CpuEngine& engine, const TriangleMesh& mesh, std::uint32_t geometry, bool pair,
                std::span<const std::uint32_t> home, Grouping& grouping) {
  auto fate = engine.allocate<std::uint8_t>(mesh.triangles.size());
  engine.for_each(mesh.triangles.size(), ClassifyStep{mesh, fate.span()});
  const auto mate = match_triangles(engine, mesh, fate.span(), pair, home);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (grouping.keep(geometry, fate[i]) && (mate[i] == kInvalidId || mate[i] >> 2 > i))
      grouping.add(make_group(mesh, geometry, i, mate[i]));
  }
}

void group_customs(CpuEngine& engine, const CustomGeometry& custom, std::uint32_t geometry, bool pair,
                   std::span<const std::uint32_t> home, Grouping& grouping) {
  const auto boxes = custom.boxes;
  auto fate = engine.allocate<std::uint8_t>(boxes.size());
  engine.for_each(boxes.size(), ClassifyBoxStep{boxes, fate.span()});
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (!grouping.keep(geometry, fate[i])) continue;
    PrimitiveGroup group{{i, kInvalidId}, geometry & kGeometryMask, PrimitiveGroup::kCustom, 0};
    const bool has_next = i % 2 == 0 && i + 1 < boxes.size() && fate[i + 1] == kKept;
    const bool may_share = pair && has_next && (home.empty() || home[i] == home[i + 1]);
    if (may_share && share_leaf(boxes[i], boxes[i + 1])) group.primitive[1] = ++i;
    grouping.add(group);
  }
}

}  // namespace

GroupedPrimitives group_primitives(CpuEngine& engine, const PrimitiveSoup& soup, bool pair,
                                   std::span<const std::uint32_t> home) {
  GroupedPrimitives result;
  result.dropped.resize(soup.geometries());
  result.groups = engine.allocate<PrimitiveGroup>(soup.size());
  engine.monitor().start("pair", 0.3, soup.size() * (pair ? 3 + 2 * kRounds : 1));
  Grouping grouping(result);
  for (std::size_t g = 0; g < soup.geometries(); ++g) {
    const auto geometry = static_cast<std::uint32_t>(g);
    const auto mine = home.empty() ? home : home.subspan(soup.first[g], soup.size(g));
    if (g < soup.meshes.size())
      group_mesh(engine, soup.meshes[g], geometry, pair, mine, grouping);
    else
      group_customs(engine, soup.customs[g - soup.meshes.size()], geometry, pair, mine, grouping);
  }
  return result;
}

}  // namespace hiprt::build
