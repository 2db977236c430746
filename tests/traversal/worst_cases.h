#pragma once
/// A ray and a triangle made from genes, and the quantities that tests derive from them. Searches find the case that
/// comes closest to a bound.

#include <hiprt_device/intersect/box_ray.h>
#include <hiprt_device/primitives/computed_leaf.h>
#include <tests/oracle/hill_climb.h>
#include <tests/oracle/ray_triangle.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <cstdio>
#include <optional>

namespace hiprt::checks {

using namespace oracle;

constexpr std::uint64_t kWorstSeed = 20261123;
constexpr unsigned kStarts = 40;

/// Three corners, an origin, and weights of the point that the ray is aimed at.
inline Genes make_genes(Random& random) {
  Genes genes;
  const double size = random.log_uniform(1e-3, 1e3), away = random.coin() ? 0.0 : random.log_uniform(1e-2, 1e5);
  for (unsigned i = 0; i < 12; ++i) genes.push_back(static_cast<float>(away + size * random.uniform(-1, 1)));
  genes.push_back(random.uniform_float(0, 1));
  genes.push_back(random.uniform_float(0, 1));
  return genes;
}

struct Case {
  Corners corners;
  Ray ray;
};

/// Nothing where numbers leave the range of the guarantees, or the triangle has no area.
inline std::optional<Case> case_of(const Genes& genes) {
  for (const float gene : genes)
    if (!std::isfinite(gene) || std::abs(gene) > 0x1p40f) return {};
  Case it;
  const auto position_at = [&](std::size_t i) { return Position{genes[i], genes[i + 1], genes[i + 2]}; };
  it.corners = {position_at(0), position_at(3), position_at(6)};
  it.ray.origin = Vec3(genes[9], genes[10], genes[11]);
  float largest = 0.0f;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double a = it.corners.p0[i], b = it.corners.p1[i], c = it.corners.p2[i];
    it.ray.direction[k] =
        static_cast<float>(a + double{genes[12]} * (b - a) + double{genes[13]} * (c - a) - double{it.ray.origin[k]});
    largest =
        std::max({largest, std::abs(genes[i]), std::abs(genes[3 + i]), std::abs(genes[6 + i]), std::abs(genes[9 + i])});
  }
  if (!is_valid(it.ray) || largest < 0x1p-40f || max_component(it.ray.direction) < 0x1p-60f * largest) return {};
  return it;
}

inline primitive_detail::ComputedLeaf<float> leaf_of(const Corners& of) {
  primitive_detail::ComputedLeaf<float> leaf{};
  const Position* corners[3] = {&of.p0, &of.p1, &of.p2};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) leaf.vertex[i][k] = (*corners[i])[k];
  leaf.info = {{0, kInvalidId}, 0, TriangleId::from_rotation(0)};
  return leaf;
}

/// The complete hit that the test finds on the triangle.
template <class Test, class Real> std::optional<BasicHit<Real>> hit_of(const Corners& of, const BasicRay<Real>& ray) {
  const auto leaf = leaf_of(of);
  const typename Test::template PreparedRay<ArrayLanes> prepared(ray);
  std::optional<BasicHit<Real>> found;
  Test::template intersect<ArrayLanes>(leaf, leaf.info, prepared, [&](const BasicCandidate<Real>& at, unsigned slot) {
    if (slot != 0 || !(at.t >= 0)) return true;
    BasicHit<Real> hit;
    hit.t = at.t, hit.u = at.u, hit.v = at.v, hit.primitive = 0;
    complete<primitive_detail::ComputedLeaves<float>>(hit, ray, leaf, 0);
    found = hit;
    return true;
  });
  return found;
}

template <class Test, class Real> std::optional<BasicHit<Real>> hit_of(const Case& it) {
  return hit_of<Test>(it.corners, convert<Real>(it.ray));
}

/// The least part of a margin that is enough; 0: none is needed.
template <class Enough> double least_part(const Enough& enough) {
  if (enough(0.0)) return 0.0;
  double low = 0.0, high = 16.0;
  for (unsigned i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (enough(middle) ? high : low) = middle;
  }
  return high;
}

inline Box box_of(const Corners& corners) {
  Box box{};
  for (std::size_t k = 0; k < 3; ++k) {
    box.min[k] = std::min({corners.p0[k], corners.p1[k], corners.p2[k]});
    box.max[k] = std::max({corners.p0[k], corners.p1[k], corners.p2[k]});
  }
  return box;
}

/// The least part of Conservative's margin with which a box passes, with the hit as the limit. The box is all of its
/// file. Where none is needed it is in (-1, 0], and the larger the less the box may shrink: the search has a way to go.
/// @param condition, reach of the file's header.
template <class Real>
double box_share(const BasicRay<Real>& ray, const Box& box, Real t, float condition, float reach) {
  const BoxRay<Real> boxes(ray, box, t);
  const float margin =
      boxes.margin(Conservative::margin(boxes.ray(ray).origin, box, condition, reach), condition, reach);
  const auto passes = [&](double part) {
    const RaySlabs<ArrayLanes> slabs(boxes.ray(ray), static_cast<float>(part * double{margin}));
    return meets_box<ArrayLanes>(box, slabs, boxes.near_end(Real(0)), boxes.far_end(t));
  };
  if (!passes(0.0)) return least_part(passes);
  double low = -12.0, high = 40.0;  // Exponents of 2.
  for (unsigned i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (passes(-std::exp2(middle)) ? low : high) = middle;
  }
  return -1.0 + 1.0 / (1.0 + std::exp2(low));
}

template <class Make, class Score> void search_genes(const char* what, const Make& make, const Score& score) {
  const Worst worst = climb(kWorstSeed, kStarts, trials(6000), make, score);
  std::printf("%-34s used up: %.3f of random cases, %.3f of those searched for\n", what, worst.random, worst.score);
  std::string text;
  for (const float gene : worst.genes) {
    char number[32];
    std::snprintf(number, sizeof number, "%a ", static_cast<double>(gene));
    text += number;
  }
  INFO(what << ", seed " << kWorstSeed << ": " << text);
  CHECK(worst.score <= 1.0);
  // The search finds worse than chance does: it looks where it should.
  CHECK(worst.score >= worst.random);
}

}  // namespace hiprt::checks
