#include <hiprt_build/pair/custom_pair.h>
#include <hiprt_build/pair/edges.h>
#include <hiprt_build/pair/pair.h>

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

/// Step: the edge across which triangle i would like to pair, 0-2, or kNone. Choices of the round before stand unless
/// their partner is taken: what is free becomes less only.
struct ChooseStep {
  static constexpr std::uint8_t kNone = 3;
  /// Of no round yet.
  static constexpr std::uint8_t kUnknown = 4;
  const TriangleMesh& mesh;
  std::span<const HalfEdge> partner;
  std::span<const HalfEdge> mate;
  std::span<std::uint8_t> choice;

  void operator()(std::size_t i) const {
    if (choice[i] == kNone || mate[i] != kInvalidId) return;
    if (choice[i] != kUnknown && mate[partner[3 * i + choice[i]] >> 2] == kInvalidId) return;
    choice[i] = kNone;
    const EdgeGain gains(mesh, i);
    float best_gain = 0.0f;
    HalfEdge best_edge = kInvalidId;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const HalfEdge other = partner[3 * i + k];
      if (other == kInvalidId || mate[other >> 2] != kInvalidId) continue;
      const float gain = gains.across(k, other);
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
    if (choice[i] == ChooseStep::kNone || mate[i] != kInvalidId) return;
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
  engine.fill(choice.span(), ChooseStep::kUnknown);
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

/// What a chunk of a geometry's primitives adds to a result.
struct PrimitiveCounts {
  std::size_t groups = 0;
  std::uint64_t pairs = 0, not_finite = 0, degenerate = 0;

  /// @return whether the primitive is kept.
  bool keep(std::uint8_t fate) {
    not_finite += fate == kNotFinite ? 1 : 0;
    degenerate += fate == kDegenerate ? 1 : 0;
    return fate == kKept;
  }
  void add(bool pair) {
    ++groups;
    pairs += pair ? 1 : 0;
  }
  void add_to(GroupedPrimitives& result, std::size_t geometry, bool custom) const {
    result.count += groups;
    result.custom_count += custom ? groups : 0;
    (custom ? result.custom_pairs : result.pairs) += pairs;
    result.dropped_not_finite += not_finite;
    result.dropped_degenerate += degenerate;
    result.dropped[geometry] += not_finite + degenerate;
  }
};

void group_mesh(CpuEngine& engine, const TriangleMesh& mesh, std::uint32_t geometry, bool pair,
                std::span<const std::uint32_t> home, GroupedPrimitives& result) {
  auto fate = engine.allocate<std::uint8_t>(mesh.triangles.size());
  engine.for_each(mesh.triangles.size(), ClassifyStep{mesh, fate.span()});
  const auto mate = match_triangles(engine, mesh, fate.span(), pair, home);
  const auto leads = [&](std::size_t i) { return mate[i] == kInvalidId || mate[i] >> 2 > i; };
  std::vector<PrimitiveCounts> counts(CpuEngine::chunk_count(mesh.triangles.size()));
  engine.for_quiet_chunks(mesh.triangles.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    PrimitiveCounts mine;
    for (std::size_t i = begin; i < end; ++i)
      if (mine.keep(fate[i]) && leads(i)) mine.add(mate[i] != kInvalidId);
    counts[chunk] = mine;
  });
  std::vector<std::size_t> first(counts.size());
  for (std::size_t chunk = 0; chunk < counts.size(); ++chunk) {
    first[chunk] = result.count;
    counts[chunk].add_to(result, geometry, false);
  }
  engine.for_quiet_chunks(mesh.triangles.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::size_t to = first[chunk];
    for (std::size_t i = begin; i < end; ++i)
      if (fate[i] == kKept && leads(i))
        result.groups[to++] = make_group(mesh, geometry, static_cast<std::uint32_t>(i), mate[i]);
  });
}

void group_customs(CpuEngine& engine, const CustomGeometry& custom, std::uint32_t geometry, bool pair,
                   std::span<const std::uint32_t> home, GroupedPrimitives& result) {
  const auto boxes = custom.boxes;
  auto fate = engine.allocate<std::uint8_t>(boxes.size());
  engine.for_each(boxes.size(), ClassifyBoxStep{boxes, fate.span()});
  PrimitiveCounts counts;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (!counts.keep(fate[i])) continue;
    PrimitiveGroup group{{i, kInvalidId}, geometry & kGeometryMask, PrimitiveGroup::kCustom, 0};
    const bool has_next = i % 2 == 0 && i + 1 < boxes.size() && fate[i + 1] == kKept;
    const bool may_share = pair && has_next && (home.empty() || home[i] == home[i + 1]);
    if (may_share && share_leaf(boxes[i], boxes[i + 1])) group.primitive[1] = ++i;
    result.groups[result.count + counts.groups] = group;
    counts.add(group.is_pair());
  }
  counts.add_to(result, geometry, true);
}

}  // namespace

GroupedPrimitives group_primitives(CpuEngine& engine, const PrimitiveSoup& soup, bool pair,
                                   std::span<const std::uint32_t> home) {
  GroupedPrimitives result;
  result.dropped.resize(soup.geometries());
  result.groups = engine.allocate<PrimitiveGroup>(soup.size());
  engine.monitor().start("pair", 0.3, soup.size() * (pair ? 3 + 2 * kRounds : 1));
  for (std::size_t g = 0; g < soup.geometries(); ++g) {
    const auto geometry = static_cast<std::uint32_t>(g);
    const auto mine = home.empty() ? home : home.subspan(soup.first[g], soup.size(g));
    if (g < soup.meshes.size())
      group_mesh(engine, soup.meshes[g], geometry, pair, mine, result);
    else
      group_customs(engine, soup.customs[g - soup.meshes.size()], geometry, pair, mine, result);
  }
  return result;
}

}  // namespace hiprt::build
