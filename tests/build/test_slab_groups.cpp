// Parts of triangles between planes. Slabs that are joined because no plane between them may be chosen: the chosen cut
// stays the same. Which ranges get spatial splits.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/reinsert/reinsert_steps.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <hiprt_build/sah_sbvh/spatial_bins.h>
#include <tests/build/machine.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <algorithm>
#include <map>

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
      bins.count(piece.box, spans);
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

/// The parts of a piece along an axis, by the first slabs of their groups.
std::map<int, SimdBox> parts_of(const Piece& piece, const SlabPlanes& planes, int axis, const SlabGroups& groups) {
  std::map<int, SimdBox> parts;
  SlabPlanes::cut(planes.plane[axis], axis, groups, planes.span(axis, piece.box.min[axis], piece.box.max[axis]),
                  piece.corners, piece.pair, piece.box, axis, [&](int slab, const SimdBox& part) {
                    CHECK(parts.count(slab) == 0);
                    parts[slab] = part;
                  });
  return parts;
}

SlabGroups random_groups(Random& random) {
  SlabGroups groups = SlabGroups::single();
  for (std::uint32_t& begins : groups.begins)
    begins = ((random.below(1u << kSpatialBins) | random.below(1u << kSpatialBins)) & SlabGroups::kSingle) | 1u;
  return groups;
}

/// @return leaves of a tree with spatial splits over long diagonal triangles beside each other.
std::size_t leaves_of_diagonals(unsigned count) {
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const float z = 1e-3f * static_cast<float>(i);
    append(mesh, {0, 0, z}, {1, 1, z}, {1, 1, z + 2e-3f});
  }
  const TriangleMesh view = mesh.view();
  const BuildInput input(SceneInput{{&view, 1}, {}});
  const GeometryTable table = input.table();
  Machine machine;
  auto references = machine.engine.allocate<Reference>(count);
  for (unsigned i = 0; i < count; ++i) {
    const LeafPrimitives leaf{i, LeafContents::make(0, 0, 0)};
    MakeReferenceStep{table, {&leaf, 1}, references.span().subspan(i, 1)}(0);
  }
  return build_sbvh(machine.engine, table, std::move(references), 8.0, {0.0f, 0.0f}).references.size();
}

}  // namespace

TEST_CASE("the parts of triangles hold all their points between the planes") {
  Random random(kSeed);
  CAPTURE(kSeed);
  std::size_t points = 0, missing = 0;
  for (unsigned i = 0; i < 200; ++i)
    for (const Piece& piece : random_pieces(random)) {
      SimdBox all = piece.box;
      for (unsigned k = 0; k < 3; ++k) all.max[k] += 0.3f;
      const SlabPlanes planes = SlabPlanes::over(all);
      const SlabGroups groups = i % 2 != 0 ? random_groups(random) : SlabGroups::single();
      for (int axis = 0; axis < 3; ++axis) {
        const auto parts = parts_of(piece, planes, axis, groups);
        for (unsigned n = 0; n < 20; ++n) {
          const double a = random.uniform(0, 1), b = random.uniform(0, 1 - a);
          const unsigned third = piece.pair && n % 2 != 0 ? 3 : 0;
          float point[3];
          for (unsigned k = 0; k < 3; ++k)
            point[k] = static_cast<float>(a * double{piece.corners.v[1].x[k]} + b * double{piece.corners.v[2].x[k]} +
                                          (1 - a - b) * double{piece.corners.v[third].x[k]});
          const float at = point[axis];
          const SlabSpan span = planes.span(axis, piece.box.min[axis], piece.box.max[axis]);
          const int slab = std::clamp(planes.span(axis, at, at).begin, span.begin, span.end);
          const auto part = parts.find(groups.first(axis, slab));
          ++points;
          bool inside = part != parts.end();
          for (int k = 0; k < 3 && inside; ++k)
            inside = point[k] >= part->second.min[k] - 1e-5f && point[k] <= part->second.max[k] + 1e-5f;
          missing += inside ? 0 : 1;
        }
      }
    }
  CHECK(points > 100000);
  CHECK(missing == 0);
}

TEST_CASE("some groups of a reference have the parts that all of them have") {
  Random random(kSeed);
  CAPTURE(kSeed);
  unsigned several = 0;
  for (unsigned i = 0; i < 100; ++i)
    for (const Piece& piece : random_pieces(random)) {
      const SlabPlanes planes = SlabPlanes::over(piece.box);
      const SlabGroups groups = random_groups(random);
      for (int axis = 0; axis < 3; ++axis) {
        const SlabSpan span = planes.span(axis, piece.box.min[axis], piece.box.max[axis]);
        if (groups.behind(axis, span.begin) > span.end) continue;
        ++several;
        std::map<int, SimdBox> parts;
        for (int slab = span.begin; slab <= span.end;) {
          int next = slab;
          for (unsigned k = 1 + random.below(4); k > 0 && next <= span.end; --k) next = groups.behind(axis, next);
          SlabPlanes::parts(planes.plane[axis], axis, groups, {slab, std::min(next, span.end + 1) - 1}, piece.corners,
                            piece.pair, piece.box, axis, [&](int group, const SimdBox& part) { parts[group] = part; });
          slab = next;
        }
        const auto expected = parts_of(piece, planes, axis, groups);
        REQUIRE(parts.size() == expected.size());
        for (const auto& [group, part] : expected) CHECK(same(parts.at(group), part));
      }
    }
  CHECK(several > 1000);
}

TEST_CASE("ranges get spatial splits where their halves overlap enough, and from three references on") {
  CHECK(halves_overlap(0.11f, 0.0f, 1.0f));
  CHECK_FALSE(halves_overlap(0.09f, 0.0f, 1.0f));
  CHECK_FALSE(halves_overlap(0.5f, 0.5f, 1.0f));
  CHECK(leaves_of_diagonals(2) == 2);
  CHECK(leaves_of_diagonals(kLeastCutRange) > kLeastCutRange);
}

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

TEST_CASE("splits that cut nothing are the cheapest divisions by where boxes begin or end") {
  Random random(kSeed);
  CAPTURE(kSeed);
  unsigned whole_splits = 0;
  for (unsigned i = 0; i < 2000; ++i) {
    const std::vector<Piece> pieces = random_pieces(random);
    SimdBox all;
    for (const Piece& piece : pieces) all.add(piece.box);
    const SlabPlanes planes = SlabPlanes::over(all);
    WholeBins bins;
    for (const Piece& piece : pieces) {
      SlabSpan spans[3];
      for (int axis = 0; axis < 3; ++axis) spans[axis] = planes.span(axis, piece.box.min[axis], piece.box.max[axis]);
      bins.count(piece.box, spans);
      bins.add(piece.corners, piece.pair, piece.box, planes, spans, SingleSlabs{});
    }
    const auto divide = [&](int axis, float plane, SplitSide crossing) {
      SpatialSplit split;
      split.left_count = split.right_count = 0;
      for (const Piece& piece : pieces) {
        const bool left = side_of(crossing, plane, piece.box.min[axis], piece.box.max[axis]) == SplitSide::kLeft;
        (left ? split.left : split.right).add(piece.box);
        ++(left ? split.left_count : split.right_count);
      }
      split.cost = split.left_count == 0 || split.right_count == 0
                       ? SimdBox::kInfinity
                       : side_cost(split.left, split.left_count) + side_cost(split.right, split.right_count);
      return split;
    };
    float least = SimdBox::kInfinity;
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 1; k < kSpatialBins; ++k)
        for (const SplitSide crossing : {SplitSide::kLeft, SplitSide::kRight})
          least = std::min(least, divide(axis, planes.plane[axis][k], crossing).cost);
    const SpatialSplit cutting = bins.SpatialBins::best(planes, 1000);
    for (const float share : {0.5f, 0.9f, 1.0f, 1e9f}) {
      const SpatialSplit best = bins.best(planes, 1000, share);
      CAPTURE(i, share, cutting.cost, least, best.cost);
      if (best.crossing == SplitSide::kBoth) {
        CHECK(best.cost == cutting.cost);
        CHECK_FALSE(least < share * cutting.cost);
        continue;
      }
      ++whole_splits;
      CHECK(best.cost == least);
      CHECK(least < share * cutting.cost);
      const SpatialSplit same_split = divide(static_cast<int>(best.axis), best.plane, best.crossing);
      CHECK((same_split.left_count == best.left_count && same_split.right_count == best.right_count));
      CHECK((same(same_split.left, best.left) && same(same_split.right, best.right)));
    }
  }
  CHECK(whole_splits > 2000);
}
