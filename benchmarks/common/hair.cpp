#include "hair.h"

#include "mesh_parts.h"
#include "random.h"

#include <hiprt_device/math/vec_functions.h>
#include <algorithm>
#include <cmath>

namespace hiprt::bench {
namespace {

const Point kHeadRadii{7.4, 10.5, 9.2};

/// Whether hair grows at a point of the unit sphere: above a line that rises from the neck to the forehead.
bool is_scalp(const Point& n) { return n.y > 0.08 + 0.5 * n.z; }

Point on_scalp(Random& random) {
  for (;;) {
    const double y = random.between(-1, 1), angle = random.between(0, kTurn), r = std::sqrt(1 - y * y);
    const Point n{r * std::cos(angle), y, r * std::sin(angle)};
    if (is_scalp(n)) return n;
  }
}

/// Height above the skin, over the hair below.
Point outside(const Point& p, double above) {
  const double depth = glm::length(p / (kHeadRadii + above));
  return depth >= 1 ? p : p / depth;
}

/// Waves that neighbouring strands share, in [-2, 2].
double lock_of(const Point& n) { return std::sin(11 * n.x + 7 * n.z) + std::sin(13 * n.y - 9 * n.z + 3 * n.x); }

/// Grows one strand.
class Strand {
 public:
  Strand(Random& random, double radius) : radius_(radius), root_(on_scalp(random)) {
    const double lock = lock_of(root_);
    // Longer at the back, where the neck is.
    length_ = 17 - 5 * root_.z + 1.5 * lock + random.between(-2, 2);
    above_ = random.between(0.05, 1.1);
    phase_ = 0.9 * lock + random.between(-0.35, 0.35);
    curl_ = 0.9 + 0.3 * lock + random.between(-0.1, 0.1);
    const double side = root_.x + 0.02 >= 0 ? 1 : -1;
    // Away from the parting, and to the back.
    comb_ = glm::normalize(Point{side * (0.8 + random.between(-0.1, 0.1)), 0.15, -0.45 + 0.1 * lock});
  }

  void add_to(std::vector<ShapePoint>& points) const {
    Point at = root_ * kHeadRadii, direction = glm::normalize(glm::normalize(root_ / kHeadRadii) + 0.8 * comb_);
    for (std::uint32_t i = 0; i < kHairPoints; ++i) {
      const double s = static_cast<double>(i) / (kHairPoints - 1);
      const Point p = i == 0 ? at : outside(at + wave(s, direction), above_ * std::sqrt(s));
      points.push_back({{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)},
                        static_cast<float>(radius_ * (1 - 0.7 * s))});
      direction = glm::normalize(direction + (0.5 + s) * Point(0, -1, 0));
      at = outside(at + direction * (length_ / (kHairPoints - 1)), above_ * std::sqrt(s));
    }
  }

 private:
  Point wave(double s, const Point& direction) const {
    const Frame frame(direction);
    const double angle = kTurn * 1.4 * s + phase_;
    return 0.8 * curl_ * s * (std::cos(angle) * frame.right + std::sin(angle) * frame.up);
  }

  double radius_;
  Point root_, comb_{};
  double length_, above_, phase_, curl_;
};

}  // namespace

Hair hair(std::uint32_t strands) {
  constexpr double kRadius = 0.0045, kUsual = 100'000;
  const double radius = std::clamp(kRadius * std::sqrt(kUsual / strands), 0.0005, 0.02);
  Random random(5);
  Hair result;
  result.points.reserve(std::size_t{strands} * kHairPoints);
  result.strands.assign(strands, kHairPoints);
  for (std::uint32_t i = 0; i < strands; ++i) Strand(random, radius).add_to(result.points);
  return result;
}

tools::Mesh hair_head() {
  constexpr std::uint32_t kRows = 100, kColumns = 160;
  // Rings at the poles would have degenerate triangles.
  constexpr double kPole = 1e-3;
  tools::Mesh mesh;
  for (std::uint32_t row = 0; row <= kRows; ++row)
    for (std::uint32_t column = 0; column <= kColumns; ++column) {
      const double a = kTurn * (column % kColumns) / kColumns, b = kPole + (kTurn / 2 - 2 * kPole) * row / kRows;
      add_vertex(mesh, Point{std::sin(b) * std::cos(a), -std::cos(b), std::sin(b) * std::sin(a)} * kHeadRadii);
    }
  add_grid_triangles(mesh, 0, kColumns, kRows);
  return mesh;
}

tools::Camera hair_camera() { return {.eye = {24, 8, 56}, .at = {1, -5, 0}, .fov_degrees = 31}; }

}  // namespace hiprt::bench
