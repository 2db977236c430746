#include <hiprt_build/steps/presplit.h>

#include <hiprt_build/steps/clip.h>
#include <hiprt_build/steps/references.h>
#include <hiprt_build/steps/sah_reduce.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <bit>
#include <cmath>

namespace hiprt::build {
namespace {

constexpr unsigned kGridBits = 21;
/// Cuts of one reference: keeps hostile scenes from spending everything on one triangle.
constexpr std::uint32_t kMostCuts = 1u << 16;
/// So many take a good part of a millisecond.
constexpr std::uint32_t kManyCuts = 1u << 10;
/// A box of up to so many times a triangle's own area is filled well enough. (1 in the paper. A right triangle along
/// the axes has 2 and gains little from cuts. SAH costs with 1, 2, 3 and 5: decision 0011.)
constexpr float kFilled = 3.0f;

struct Plane {
  unsigned axis;
  float position;
};

/// Planes that halve a cube around the scene, its halves, and so on.
class PlaneGrid {
 public:
  explicit PlaneGrid(const Aabb& scene) : low_(scene.min) {
    const Float4 extent = scene.max - scene.min;
    const float longest = std::max({extent[0], extent[1], extent[2]});
    if (longest > 0x1p-100f && longest < Aabb::kInfinity) {
      cells_per_unit_ = static_cast<float>(1u << kGridBits) / longest;
      unit_ = longest / static_cast<float>(1u << kGridBits);
    }
  }

  /// How coarse the coarsest plane through a box is: kGridBits for the one that halves the scene, 0 for none.
  unsigned coarseness(const Aabb& box) const {
    unsigned best = 0;
    for (unsigned axis = 0; axis < 3; ++axis) best = std::max(best, coarseness(box, axis));
    return best;
  }

  /// The coarsest plane through a box, of equal ones that across its longest edge; the middle of that where the grid is
  /// too coarse. The plane may lie on the border of the box only if the box is too small to be halved.
  Plane through(const Aabb& box) const {
    const Float4 extent = box.max - box.min;
    Plane best{0, 0.0f};
    unsigned coarsest = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned here = coarseness(box, axis);
      const bool longer = extent[axis] > extent[best.axis];
      if (axis != 0 && (here < coarsest || (here == coarsest && !longer))) continue;
      coarsest = here;
      best.axis = axis;
    }
    const float low = box.min[best.axis], high = box.max[best.axis];
    if (coarsest > 0) {
      const std::uint32_t plane = cell(high, best.axis) >> (coarsest - 1) << (coarsest - 1);
      best.position = low_[best.axis] + static_cast<float>(plane) * unit_;
      if (best.position > low && best.position < high) return best;
    }
    best.position = 0.5f * low + 0.5f * high;
    return best;
  }

 private:
  std::uint32_t cell(float x, unsigned axis) const {
    const float position = (x - low_[axis]) * cells_per_unit_;
    // No number where the scene's extent overflows: there is no grid then.
    if (!(position > 0.0f)) return 0;
    return static_cast<std::uint32_t>(std::min(position, static_cast<float>((1u << kGridBits) - 1)));
  }
  unsigned coarseness(const Aabb& box, unsigned axis) const {
    return static_cast<unsigned>(std::bit_width(cell(box.min[axis], axis) ^ cell(box.max[axis], axis)));
  }

  Float4 low_;
  float cells_per_unit_ = 0.0f, unit_ = 0.0f;
};

/// Area that boxes around ever smaller parts of a group's triangles come down to: as half_area().
float least_area(const std::array<Position, 4>& v, bool pair) {
  const auto area = [](const Position& a, const Position& b, const Position& c) {
    const Float4 p = to_float4(a), x = to_float4(b) - p, y = to_float4(c) - p;
    float sum = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
      const int k = (axis + 1) % 3, m = (axis + 2) % 3;
      sum += std::abs(x[k] * y[m] - x[m] * y[k]);
    }
    return 0.5f * sum;
  };
  return area(v[0], v[1], v[2]) + (pair ? area(v[1], v[3], v[2]) : 0.0f);
}

class Presplitter {
 public:
  Presplitter(CpuEngine& engine, const PrimitiveSoup& soup, std::span<const PrimitiveGroup> groups,
              std::span<const Reference> references)
      : engine_(engine),
        soup_(soup),
        groups_(groups),
        references_(references),
        grid_(bound_references(engine, references).box),
        weight_(engine.allocate<float>(references.size())) {
    engine.for_each(references.size(), [this](std::size_t i) { weight_[i] = weight(references_[i]); });
  }

  ScratchArray<Reference> run(std::size_t most_cuts) {
    scale_ = find_scale(most_cuts);
    std::vector<std::size_t> first(CpuEngine::chunk_count(references_.size()));
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t count = 0;
      cut_all(begin, end, [&](const Reference&) { ++count; });
      first[chunk] = count;
    });
    auto result = engine_.allocate<Reference>(engine_.exclusive_scan(std::span<std::size_t>(first)));
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t to = first[chunk];
      cut_all(begin, end, [&](const Reference& part) { result[to++] = part; });
    });
    return result;
  }

 private:
  /// In proportion to the cuts that a reference should have.
  float weight(const Reference& reference) const {
    const Aabb box = reference.box();
    const unsigned coarse = grid_.coarseness(box);
    const PrimitiveGroup& group = groups_[reference.leaf];
    const float empty = half_area(box) - kFilled * least_area(group.vertices(soup_), group.is_pair());
    if (coarse == 0 || !(empty > 0.0f) || !(empty < Aabb::kInfinity)) return 0.0f;
    const float weight = std::cbrt(std::ldexp(empty, static_cast<int>(coarse) - static_cast<int>(kGridBits)));
    return weight > 0.0f ? weight : 0.0f;
  }

  std::uint32_t cuts(std::size_t i, float scale) const {
    const float wanted = weight_[i] * scale;
    return wanted < static_cast<float>(kMostCuts) ? static_cast<std::uint32_t>(wanted) : kMostCuts;
  }
  std::uint32_t cuts(std::size_t i) const { return cuts(i, scale_); }

  /// The largest factor of weights, nearly, with which no more than so many cuts are made in all.
  float find_scale(std::size_t most_cuts) {
    const auto total = [&](float scale) {
      return tbb::parallel_reduce(
          tbb::blocked_range<std::size_t>(0, references_.size(), CpuEngine::kChunk), std::size_t{0},
          [&](const tbb::blocked_range<std::size_t>& range, std::size_t sum) {
            engine_.monitor().check();
            for (std::size_t i = range.begin(); i < range.end(); ++i) sum += cuts(i, scale);
            return sum;
          },
          std::plus<>{});
    };
    // Positive floats order as their bits do.
    std::uint32_t good = 0, bad = std::bit_cast<std::uint32_t>(Aabb::kInfinity);
    constexpr std::uint32_t kPrecision = 1u << 12;
    while (bad - good > kPrecision) {
      const std::uint32_t middle = good + (bad - good) / 2;
      (total(std::bit_cast<float>(middle)) <= most_cuts ? good : bad) = middle;
    }
    return std::bit_cast<float>(good);
  }

  /// emit(part) for the parts of references [begin, end).
  template <class Emit> void cut_all(std::size_t begin, std::size_t end, const Emit& emit) const {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t wanted = cuts(i);
      // Few large references can take most of the cuts.
      if (wanted > kManyCuts) engine_.monitor().check();
      cut(references_[i], wanted, emit);
    }
  }

  /// emit(part) for each of the parts, at most cuts + 1.
  template <class Emit> void cut(const Reference& whole, std::uint32_t cuts, const Emit& emit) const {
    if (cuts == 0) return emit(whole);
    const Aabb box = whole.box();
    const Plane plane = grid_.through(box);
    if (!(plane.position > box.min[plane.axis] && plane.position < box.max[plane.axis])) return emit(whole);
    const SplitBounds parts = split_bounds(soup_, groups_[whole.leaf], box, plane.axis, plane.position);
    const float left = longest(parts.left), right = longest(parts.right);
    const float share = left + right > 0.0f ? left / (left + right) : 0.5f;
    const std::uint32_t rest = cuts - 1;
    const auto to_left = static_cast<std::uint32_t>(std::lround(static_cast<float>(rest) * share));
    cut(make_reference(parts.left, whole.leaf), to_left, emit);
    cut(make_reference(parts.right, whole.leaf), rest - to_left, emit);
  }

  static float longest(const Aabb& box) {
    const Float4 extent = box.max - box.min;
    return std::max({extent[0], extent[1], extent[2]});
  }
  CpuEngine& engine_;
  const PrimitiveSoup& soup_;
  std::span<const PrimitiveGroup> groups_;
  std::span<const Reference> references_;
  PlaneGrid grid_;
  ScratchArray<float> weight_;
  float scale_ = 0.0f;
};

}  // namespace

ScratchArray<Reference> presplit(CpuEngine& engine, const PrimitiveSoup& soup, std::span<const PrimitiveGroup> groups,
                                 ScratchArray<Reference> references, double budget) {
  const std::size_t most = room_for_splits(references.size(), budget);
  if (most <= references.size()) return references;
  engine.monitor().start("cut", 0.4, 3 * references.size());
  return Presplitter(engine, soup, groups, references.span()).run(most - references.size());
}

}  // namespace hiprt::build
