#pragma once
/// A line and the two triangles of a leaf, in every degenerate position and at every scale.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/ray.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>

#include <tests/catch.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace hiprt::checks {

/// Two triangles of a leaf: (v0, v1, v2) and (v1, v3, v2).
struct Pair {
  std::array<Position, 4> vertex;
  Corners triangle(unsigned i) const {
    return i == 0 ? Corners{vertex[0], vertex[1], vertex[2]} : Corners{vertex[1], vertex[3], vertex[2]};
  }
  PlanesLeaf leaf() const {
    PlanesLeaf leaf{};
    for (unsigned axis = 0; axis < 3; ++axis)
      for (unsigned i = 0; i < 4; ++i) leaf.coordinate[axis][i] = vertex[i][axis];
    leaf.info = {{0, 1}, 0, TriangleId::from_rotation(0) | TriangleId::from_rotation(0) << 8};
    return leaf;
  }
};

/// What random cases are made of.
enum class Kind { kLattice, kWild, kBits, kHuge, kEdge, kVertex, kFar, kNeedle, kSpread, kInside, kCount };

inline Position middle(const Position& a, const Position& b, double s) {
  Position result{};
  for (std::size_t k = 0; k < 3; ++k) result[k] = static_cast<float>(a[k] + s * (double{b[k]} - a[k]));
  return result;
}

struct Case {
  Pair pair;
  Ray ray;
};

/// kLattice: small integers, so that lines and triangles meet in every degenerate position. kWild, kBits, kHuge: any
/// scale. kInside: aimed at the interior of the first triangle, from far and near. The others are aimed at edges and
/// vertices as closely as floats allow; the corners of a kSpread triangle have different scales.
inline Case make_case(Kind kind, Random& random) {
  const auto number = [&]() -> float {
    if (kind == Kind::kLattice) return static_cast<float>(random.below(5)) - 2.0f;
    if (kind == Kind::kWild || kind == Kind::kSpread)
      return static_cast<float>(random.log_uniform(1e-38, 1e37)) * (random.coin() ? 1.0f : -1.0f);
    if (kind == Kind::kHuge) return random.uniform_float(-3.4e38, 3.4e38);
    if (kind == Kind::kBits) {
      float bits = random.any_float();
      while (!std::isfinite(bits)) bits = random.any_float();
      return bits;
    }
    return random.uniform_float(-1, 1);
  };
  const auto point = [&] { return Position{number(), number(), number()}; };
  Case result{{{point(), point(), point(), point()}}, {}};
  auto& v = result.pair.vertex;
  if (kind == Kind::kNeedle) {
    const float thin = static_cast<float>(random.log_uniform(1e-7, 1e-3));
    for (unsigned i : {1u, 3u})
      for (std::size_t k = 0; k < 3; ++k) v[i][k] = v[0][k] + thin * v[i][k];
  }
  const bool spread = kind == Kind::kSpread;
  const float away =
      kind == Kind::kFar || kind == Kind::kInside ? static_cast<float>(random.log_uniform(1e1, 1e7)) : 1.0f;
  Position origin = point();
  for (float& x : origin) x = spread ? random.uniform_float(-1, 1) : x * away;
  result.ray.origin = vec3(origin);
  if (kind <= Kind::kHuge) {
    do result.ray.direction = vec3(point());
    while (result.ray.direction == Vec3(0.0f));
    return result;
  }
  const unsigned from = random.below(4), to = random.below(4);
  const double part = spread ? random.log_uniform(1e-38, 1) : random.unit();
  const Position target = kind == Kind::kInside   ? middle(v[2], middle(v[0], v[1], part), random.unit())
                          : kind == Kind::kVertex ? v[from]
                                                  : middle(v[from], v[to], part);
  for (int k = 0; k < 3; ++k)
    result.ray.direction[k] = target[static_cast<std::size_t>(k)] - origin[static_cast<std::size_t>(k)];
  return result;
}

inline std::string text_of(const Pair& pair) {
  std::string text;
  char number[50];
  for (const Position& p : pair.vertex) {
    std::snprintf(number, sizeof number, "(%a, %a, %a) ", static_cast<double>(p[0]), static_cast<double>(p[1]),
                  static_cast<double>(p[2]));
    text += number;
  }
  return text;
}

/// Calls check(case) for random cases of a kind; failures name the case.
template <class Check> void check_cases(int kind, std::uint64_t seed, unsigned count, Check&& check) {
  Random random(seed + static_cast<std::uint64_t>(kind));
  for (unsigned i = 0; i < count; ++i) {
    const Case it = make_case(static_cast<Kind>(kind), random);
    INFO("kind " << kind << ", case " << i << " of seed " << seed << ": " << describe(it.ray) << " "
                 << text_of(it.pair));
    check(it);
  }
}

}  // namespace hiprt::checks
