// Slabs that are joined because no plane between them may be chosen: the chosen cut stays the same.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/reinsert/reinsert_steps.h>
#include <hiprt_build/sah_sbvh/spatial_bins.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::build;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20261130;

struct Piece {
  LeafCorners corners;
  SimdBox box;
  bool pair;
};

/// Triangles and pairs of any size, some of them flat.
std::vector<Piece> random_pieces(Random& random) {
  std::vector<Piece> pieces(2 + random.below(60));
  const double largest = random.uniform(0.01, 2.0);
  for (Piece& piece : pieces) {
    piece.pair = random.below(2) != 0;
    double center[3];
    for (double& x : center) x = random.uniform(-1, 1);
    const double size = largest * random.uniform(0.0, 1.0);
    const unsigned flat = random.below(6);
    for (Point& corner : piece.corners.v)
      for (unsigned k = 0; k < 3; ++k)
        corner.x[k] = static_cast<float>(center[k] + (k == flat ? 0.0 : size * random.uniform(-1, 1)));
    if (!piece.pair) piece.corners.v[3] = piece.corners.v[2];
    for (const Point& corner : piece.corners.v) piece.box.add(to_float4(corner));
  }
  return pieces;
}

struct Slabs {
  SlabPlanes planes;
  SpatialBins bins;

  Slabs(const std::vector<Piece>& pieces, const SlabGroups* groups) {
    SimdBox all;
    for (const Piece& piece : pieces) all.add(piece.box);
    planes = SlabPlanes::over(all);
    for (const Piece& piece : pieces) {
      SlabSpan spans[3];
      for (int axis = 0; axis < 3; ++axis) spans[axis] = planes.span(axis, piece.box.min[axis], piece.box.max[axis]);
      bins.count(spans);
      if (groups != nullptr)
        bins.add(piece.corners, piece.pair, piece.box, planes, spans, *groups);
      else
        bins.add(piece.corners, piece.pair, piece.box, planes, spans, SingleSlabs{});
    }
  }
};

bool same(const SimdBox& a, const SimdBox& b) {
  for (int k = 0; k < 3; ++k)
    if (std::abs(a.min[k] - b.min[k]) > 1e-6f || std::abs(a.max[k] - b.max[k]) > 1e-6f) return false;
  return true;
}

}  // namespace

TEST_CASE("groups of slabs: the first slab of each, and the one behind") {
  Random random(kSeed);
  for (unsigned i = 0; i < 2000; ++i) {
    SlabGroups groups = SlabGroups::single();
    for (std::uint32_t& begins : groups.begins)
      begins = (random.below(1u << kSpatialBins) & random.below(1u << 16)) | 1u;
    for (int axis = 0; axis < 3; ++axis)
      for (int slab = 0; slab < kSpatialBins; ++slab) {
        int first = slab, behind = slab + 1;
        while ((groups.begins[axis] >> first & 1u) == 0) --first;
        while (behind < kSpatialBins && (groups.begins[axis] >> behind & 1u) == 0) ++behind;
        CHECK(groups.first(axis, slab) == first);
        CHECK(groups.behind(axis, slab) == behind);
      }
  }
}

TEST_CASE("joined slabs give the cut of single ones, and planes that cut too many are never chosen") {
  Random random(kSeed);
  CAPTURE(kSeed);
  unsigned joined = 0, none = 0, cuts = 0;
  for (unsigned i = 0; i < 3000; ++i) {
    CAPTURE(i);
    const std::vector<Piece> pieces = random_pieces(random);
    const std::size_t most = pieces.size() + random.below(static_cast<std::uint32_t>(pieces.size()));
    const Slabs single(pieces, nullptr);
    const SlabGroups groups = single.bins.groups(most);
    const SpatialSplit expected = single.bins.best(single.planes, most);
    // Counted plane by plane.
    std::size_t crossing = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int plane = 1; plane < kSpatialBins; ++plane) {
        std::size_t left = 0, right = 0;
        for (const Piece& piece : pieces) {
          const SlabSpan span = single.planes.span(axis, piece.box.min[axis], piece.box.max[axis]);
          left += span.begin < plane ? 1 : 0;
          right += span.end >= plane ? 1 : 0;
        }
        CHECK((groups.begins[axis] >> plane & 1u) == (left != 0 && right != 0 && left + right <= most ? 1u : 0u));
        crossing = std::max(crossing, left + right - pieces.size());
      }
    CHECK(single.bins.crossing() == crossing);
    joined += groups.begins[0] != SlabGroups::kSingle ? 1 : 0;
    if (!groups.has_planes()) {
      ++none;
      CHECK_FALSE(expected.cost < SimdBox::kInfinity);
      continue;
    }
    const Slabs grouped(pieces, &groups);
    const SpatialSplit found = grouped.bins.best(grouped.planes, most);
    ++cuts;
    // Planes of nearly the same cost may change places.
    CHECK(found.cost == Approx(expected.cost).epsilon(1e-5));
    if (found.axis != expected.axis || found.plane != expected.plane) continue;
    CHECK((found.left_count == expected.left_count && found.right_count == expected.right_count));
    CHECK((same(found.left, expected.left) && same(found.right, expected.right)));
  }
  CHECK(joined > 500);
  CHECK(none > 30);
  CHECK(cuts > 1000);
}

TEST_CASE("rounds that nobody named are fewer where splits more than double the references") {
  CHECK(usual_rounds(32, 100, 100) == 32);
  CHECK(usual_rounds(32, 100, 200) == 32);
  CHECK(usual_rounds(32, 100, 201) == 31);
  CHECK(usual_rounds(32, 100, 300) == 21);
  CHECK(usual_rounds(32, 0xffffffffu, 0xffffffffull * 3) == 21);
  CHECK(usual_rounds(0, 100, 300) == 0);
  const Mesh mesh = cables(1000, kSeed);
  const auto leaves_of = [&](std::optional<unsigned> rounds) {
    const auto bvh = build::build(std::vector{mesh.view()}, {.builder = Builder::kHq, .reinsertion_rounds = rounds});
    REQUIRE(bvh.has_value());
    const BufferView view = *open_buffer(bvh->buffer.bytes());
    const auto leaves = view.bytes.subspan(view.leaves.offset, view.leaves.count * sizeof(PlanesLeaf));
    return std::pair(bvh->statistics, std::vector<std::byte>(leaves.begin(), leaves.end()));
  };
  const auto [statistics, usual] = leaves_of(std::nullopt);
  const std::uint64_t references = mesh.triangles.size() - statistics.pairs;
  const unsigned rounds = usual_rounds(32, references, statistics.leaves);
  CAPTURE(references, statistics.leaves, rounds);
  CHECK(rounds < 32);
  CHECK((usual == leaves_of(rounds).second));
  CHECK_FALSE((usual == leaves_of(32).second));
}
