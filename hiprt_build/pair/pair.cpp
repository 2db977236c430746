#include <hiprt_build/pair/custom_pair.h>
#include <hiprt_build/pair/edges.h>
#include <hiprt_build/pair/pair.h>

namespace hiprt::build {
namespace {

/// @pre the triangle's indices are below positions.size().
DropReason drop_reason_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto corner = [&](unsigned k) { return mesh.positions[mesh.triangles[triangle][k]].data(); };
  return drop_reason(corner(0), corner(1), corner(2));
}

/// Step: whether triangle i is dropped.
struct ClassifyStep {
  const TriangleMesh& mesh;
  std::span<std::uint8_t> reason;

  void operator()(std::size_t i) const { reason[i] = drop_reason_of(mesh, i); }
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

/// Step: the mates of the caller's pair i, if one leaf can hold its triangles.
struct GivenPairStep {
  const TriangleMesh& mesh;
  std::span<const std::uint8_t> reason;
  std::span<const std::uint32_t> home;
  std::span<HalfEdge> mate;

  void operator()(std::size_t i) const {
    const std::uint32_t a = mesh.pairs[i][0], b = mesh.pairs[i][1];
    if (a == b || reason[a] != kKept || reason[b] != kKept || !MatchEdgesStep::may_pair(4 * a, 4 * b)) return;
    if (!home.empty() && home[a] != home[b]) return;
    for (std::uint32_t edge = 0; edge < 9; ++edge) {
      const std::uint32_t k = edge / 3, n = edge % 3;
      if (corner(a, k) != corner(b, (n + 1) % 3) || corner(a, (k + 1) % 3) != corner(b, n)) continue;
      mate[a] = 4 * b + n;
      mate[b] = 4 * a + k;
      return;
    }
  }

 private:
  const Position& corner(std::uint32_t triangle, std::uint32_t k) const {
    return mesh.positions[mesh.triangles[triangle][k]];
  }
};

constexpr int kRounds = 6;

/// Mates of a mesh's triangles (half-edge of the other triangle), kInvalidId for single ones.
/// @param home of the mesh's triangles, or empty.
ScratchArray<HalfEdge> match_triangles(CpuEngine& engine, const TriangleMesh& mesh,
                                       std::span<const std::uint8_t> reason, bool pair_triangles,
                                       std::span<const std::uint32_t> home) {
  auto mate = engine.allocate<HalfEdge>(mesh.triangles.size());
  engine.fill(mate.span(), kInvalidId);
  if (!pair_triangles) return mate;
  if (!mesh.pairs.empty()) {
    engine.for_each(mesh.pairs.size(), GivenPairStep{mesh, reason, home, mate.span()});
    return mate;
  }
  auto partner = find_partners(engine, mesh, reason);
  if (!home.empty()) engine.for_each(mesh.triangles.size(), StayHomeStep{home, partner.span()});
  auto choice = engine.allocate<std::uint8_t>(mesh.triangles.size());
  engine.fill(choice.span(), ChooseStep::kUnknown);
  for (int round = 0; round < kRounds; ++round) {
    engine.for_each(mesh.triangles.size(), ChooseStep{mesh, partner.span(), mate.span(), choice.span()});
    engine.for_each(mesh.triangles.size(), ShakeHandsStep{partner.span(), choice.span(), mate.span()});
  }
  return mate;
}

/// The leaf in which triangle i is the lower one. @p other kInvalidId or a half-edge of the second triangle.
LeafContents contents_of(const TriangleMesh& mesh, std::uint32_t i, HalfEdge other) {
  LeafContents contents = LeafContents::make(0, 0, 0);
  if (other == kInvalidId) return contents;
  // Edge b of the second triangle runs from v2 to v1; the first one's shared edge from v1 to v2.
  const std::uint32_t second = other >> 2, b = other & 3u;
  const Position& v2 = mesh.positions[mesh.triangles[second][b]];
  const Position& v1 = mesh.positions[mesh.triangles[second][(b + 1) % 3]];
  for (std::uint32_t a = 0; a < 3; ++a) {
    if (mesh.positions[mesh.triangles[i][a]] != v1 || mesh.positions[mesh.triangles[i][(a + 1) % 3]] != v2) continue;
    contents = LeafContents::make(second - i, (a + 2) % 3, (b + 1) % 3);
  }
  return contents;
}

/// Step: whether custom primitive i is dropped.
struct ClassifyBoxStep {
  const BoxSpan& boxes;
  std::span<std::uint8_t> reason;

  void operator()(std::size_t i) const { reason[i] = drop_reason(boxes[i]); }
};

/// What a chunk of a geometry's primitives adds to a result.
struct PrimitiveCounts {
  std::size_t leaves = 0;
  std::uint64_t pairs = 0, not_finite = 0, degenerate = 0;

  /// @return whether the primitive is kept.
  bool keep(std::uint8_t reason) {
    not_finite += reason == kNotFinite ? 1 : 0;
    degenerate += reason == kDegenerate ? 1 : 0;
    return reason == kKept;
  }
  void add(bool pair) {
    ++leaves;
    pairs += pair ? 1 : 0;
  }
  void add_to(PairedPrimitives& result, std::size_t geometry, bool custom) const {
    result.count += leaves;
    result.custom_count += custom ? leaves : 0;
    (custom ? result.custom_pairs : result.pairs) += pairs;
    result.dropped_not_finite += not_finite;
    result.dropped_degenerate += degenerate;
    result.dropped[geometry] += not_finite + degenerate;
  }
};

/// @param first number of the mesh's first triangle among those of all geometries.
void pair_mesh(CpuEngine& engine, const TriangleMesh& mesh, std::size_t geometry, std::uint32_t first, bool pair,
               std::span<const std::uint32_t> home, PairedPrimitives& result) {
  auto reason = engine.allocate<std::uint8_t>(mesh.triangles.size());
  engine.for_each(mesh.triangles.size(), ClassifyStep{mesh, reason.span()});
  const auto mate = match_triangles(engine, mesh, reason.span(), pair, home);
  const auto leads = [&](std::size_t i) { return mate[i] == kInvalidId || mate[i] >> 2 > i; };
  std::vector<PrimitiveCounts> counts(CpuEngine::chunk_count(mesh.triangles.size()));
  engine.for_quiet_chunks(mesh.triangles.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    PrimitiveCounts mine;
    for (std::size_t i = begin; i < end; ++i)
      if (mine.keep(reason[i]) && leads(i)) mine.add(mate[i] != kInvalidId);
    counts[chunk] = mine;
  });
  std::vector<std::size_t> first_leaf(counts.size());
  for (std::size_t chunk = 0; chunk < counts.size(); ++chunk) {
    first_leaf[chunk] = result.count;
    counts[chunk].add_to(result, geometry, false);
  }
  engine.for_quiet_chunks(mesh.triangles.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::size_t to = first_leaf[chunk];
    for (std::size_t i = begin; i < end; ++i) {
      if (reason[i] != kKept || !leads(i)) continue;
      const auto triangle = static_cast<std::uint32_t>(i);
      result.leaves[to++] = {first + triangle, contents_of(mesh, triangle, mate[i])};
    }
  });
}

void pair_customs(CpuEngine& engine, const CustomGeometry& custom, std::size_t geometry, std::uint32_t first, bool pair,
                  std::span<const std::uint32_t> home, PairedPrimitives& result) {
  const BoxSpan& boxes = custom.boxes;
  auto reason = engine.allocate<std::uint8_t>(boxes.size());
  engine.for_each(boxes.size(), ClassifyBoxStep{boxes, reason.span()});
  PrimitiveCounts counts;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (!counts.keep(reason[i])) continue;
    const bool has_next = i % 2 == 0 && i + 1 < boxes.size() && reason[i + 1] == kKept;
    const bool may_share = pair && has_next && (home.empty() || home[i] == home[i + 1]);
    const bool is_pair = may_share && share_leaf(boxes[i], boxes[i + 1]);
    result.leaves[result.count + counts.leaves] = {first + i,
                                                   LeafContents::make(is_pair ? 1 : 0, LeafContents::kCustom, 0)};
    counts.add(is_pair);
    i += is_pair ? 1 : 0;
  }
  counts.add_to(result, geometry, true);
}

}  // namespace

PairedPrimitives pair_primitives(CpuEngine& engine, const BuildInput& input, bool pair,
                                 std::span<const std::uint32_t> home) {
  PairedPrimitives result;
  result.dropped.resize(input.geometries.size());
  result.leaves = engine.allocate<LeafPrimitives>(input.primitive_count());
  engine.monitor().start("pair", 0.3, std::uint64_t{input.primitive_count()} * (pair ? 3 + 2 * kRounds : 1));
  for (std::size_t g = 0; g < input.geometries.size(); ++g) {
    const GeometryView& geometry = input.geometries[g];
    const auto mine = home.empty() ? home : home.subspan(geometry.first, geometry.primitive_count);
    if (input.is_custom(g))
      pair_customs(engine, input.customs[g - input.meshes.size()], g, geometry.first, pair, mine, result);
    else
      pair_mesh(engine, input.meshes[g], g, geometry.first, pair, mine, result);
  }
  return result;
}

}  // namespace hiprt::build
