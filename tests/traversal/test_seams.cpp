// Lines in the seams' planes of round cones: ball and cone must not both leave them to the other.

#include <hiprt_device/primitives/round_curve.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <array>
#include <cmath>

using namespace hiprt;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;
using Integers = std::array<int, 3>;

int dot(const Integers& a, const Integers& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Integers cross(const Integers& a, const Integers& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Integers random_integers(Random& random, int most) {
  Integers result{};
  for (int& x : result) x = static_cast<int>(random.below(static_cast<std::uint32_t>(2 * most + 1))) - most;
  return result;
}

/// A line exactly in the plane of the first ball's seam, all of small integers. The plane is y . w = -r0 dr.
struct LineInSeam {
  Integers w, y, direction;  ///< The axis, a point of the line from the first center, and along the line.
  int r0, r1;

  bool find(Random& random) {
    w = random_integers(random, 40);
    r0 = 8 + static_cast<int>(random.below(40));
    r1 = static_cast<int>(random.below(64));
    y = random_integers(random, r0);
    direction = cross(w, random_integers(random, 4));
    const int dr = r1 - r0, length = dot(w, w);
    if (length <= dr * dr || dot(direction, direction) == 0 || dot(y, w) != -r0 * dr) return false;
    // The distance of the line from the center, against the seam's circle: clearly inside.
    const Integers off = cross(y, direction);
    const double distance = std::sqrt(double(dot(off, off)) / dot(direction, direction));
    return distance < 0.99 * r0;
  }

  /// @param reversed whether the first ball is the curve's second vertex. @param moved by so many directions.
  unsigned count_hits(bool reversed, int moved) const {
    CurveVertex vertices[2]{};
    const Integers center{100, -50, 25};
    Ray ray;
    ray.tmin = -std::numeric_limits<float>::max();
    for (std::size_t k = 0; k < 3; ++k) {
      vertices[reversed].position[k] = static_cast<float>(center[k]);
      vertices[!reversed].position[k] = static_cast<float>(center[k] + w[k]);
    }
    vertices[reversed].radius = static_cast<float>(r0);
    vertices[!reversed].radius = static_cast<float>(r1);
    const Integers from{center[0] + y[0] + moved * direction[0], center[1] + y[1] + moved * direction[1],
                        center[2] + y[2] + moved * direction[2]};
    ray.origin = Vec3(static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2]));
    ray.direction =
        Vec3(static_cast<float>(direction[0]), static_cast<float>(direction[1]), static_cast<float>(direction[2]));
    unsigned hits = 0;
    constexpr std::uint32_t kFirst = 0;
    RoundCurveSet{vertices, &kFirst}.intersect(ray, ray.tmin, ray.tmax, 0, [&](const CustomHit&) {
      ++hits;
      return true;
    });
    return hits;
  }
};

}  // namespace

TEST_CASE("a line in a seam's plane that passes inside the ball is hit twice") {
  Random random(kSeed);
  unsigned found = 0;
  for (unsigned i = 0; i < 4000000 && found < 4000; ++i) {
    LineInSeam line;
    if (!line.find(random)) continue;
    ++found;
    for (const bool reversed : {false, true})
      for (const int moved : {0, -3, 1000}) {
        INFO("seed " << kSeed << ", line " << i << ", reversed " << reversed << ", moved " << moved);
        REQUIRE(line.count_hits(reversed, moved) == 2);
      }
  }
  CHECK(found >= 1000);
}

TEST_CASE("the cone counts lines that are up to 2^-50 sizes behind its seams") {
  // docs/proofs/round-shapes.md, Round cone. A cylinder of length 1 and radius 0.5 along x; a line across it.
  using namespace primitive_detail;
  ConeLine line{};
  line.w = {1, 0, 0};
  line.direction = {0, 1, 0};
  line.first.radius = line.last.radius = 0.5;
  line.last.center = {1, 0, 0};
  line.prepare(1.0);
  constexpr double kDoubt = 0x1p-50 * (1 + 0.5 + 0.5);
  for (const auto& [z, dips] : {std::pair{-kDoubt * (1 + 0x1p-20), false},
                                {-kDoubt * (1 - 0x1p-20), true},
                                {1 + 0.5 * kDoubt, true},
                                {1 + 2 * kDoubt, false}}) {
    CAPTURE(z);
    CHECK(ConeForm(line, {z, 0, 0}).dips(line) == dips);
  }
}
