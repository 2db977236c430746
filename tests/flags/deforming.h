#pragma once
/// MovingTriangleSet: at every time the hits are those of the still mesh of that time, bit for bit. Nothing leaks, and
/// nothing leaves its boxes.

#include <hiprt_device/primitives/moving_triangle.h>
#include <tests/flags/boxes.h>

#include <cmath>
#include <string>
#include <vector>

namespace hiprt::flags {

/// A closed mesh at three times, its vertices moved along one axis, along all, or not at all.
class Deforming {
 public:
  explicit Deforming(const Mesh& mesh) : keys_{mesh, mesh, mesh} {
    Random random(kSeed + 11);
    for (std::size_t key = 1; key < keys_.size(); ++key)
      for (build::Position& p : keys_[key].positions) {
        const std::uint32_t kind = random.below(3);
        const Vec3 step = lattice_point(random, 256);
        for (unsigned axis = 0; axis < 3; ++axis)
          if (kind == 2 || (kind == 1 && axis == key)) p[axis] += step[static_cast<int>(axis)];
      }
    for (const Mesh& key : keys_)
      for (const auto& p : key.positions) positions_.insert(positions_.end(), p.begin(), p.end());
    for (const auto& t : mesh.triangles) triangles_.insert(triangles_.end(), t.begin(), t.end());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) boxes_.push_back(set().bounds(i));
    const build::CustomGeometry geometry[1] = {{.boxes = boxes_}};
    bvh_ = must(build::build(build::SceneInput{{}, geometry}));
  }

  MovingTriangleSet set() const {
    return {{positions_.data(), kTimes, triangles_.data(), static_cast<std::uint32_t>(keys_[0].positions.size()),
             static_cast<std::uint32_t>(keys_.size())}};
  }
  const std::vector<Box>& boxes() const { return boxes_; }
  /// Each vertex rounded as by the set: no compiler can do otherwise.
  Mesh at(float time) const {
    const std::size_t k = time >= kTimes[1] ? 1 : 0;
    const float begin = kTimes[k], end = kTimes[k + 1];
    const float s = time <= begin ? 0.0f : time >= end ? 1.0f : (time - begin) / (end - begin);
    Mesh mesh = keys_[k];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float rest = (1.0f - s) * keys_[k].positions[i][axis];
        mesh.positions[i][axis] = std::fma(s, keys_[k + 1].positions[i][axis], rest);
      }
    return mesh;
  }
  template <class P> [[gnu::noinline]] BasicHit<typename P::Real> hit(const BasicRay<typename P::Real>& ray) const {
    using List = PrimitiveList<MovingTriangleSet>;
    typename P::Stack::Memory memory;
    return ClosestHit<P, NoFilter, List>(view_of(bvh_), ray, typename P::Stack::Storage(memory), {}, List{set()})
        .next_hit();
  }

 private:
  static constexpr float kTimes[] = {-1.0f, 0.25f, 3.0f};

  std::vector<Mesh> keys_;
  std::vector<float> positions_;
  std::vector<std::uint32_t> triangles_;
  std::vector<Box> boxes_;
  build::Bvh bvh_;
};

/// @tparam P Policies or DoubleRays<>.
template <class P> unsigned deforming_mesh(const std::string& name) {
  using Real = typename P::Real;
  constexpr unsigned kTimes = 60, kRays = 10;
  const Deforming deforming(lattice_mesh(2));
  Check check(name, kSeed + 12);
  Random random(kSeed + 12);
  for (unsigned i = 0; i < kTimes; ++i) {
    const float time = any_time(random);
    const Mesh mesh = deforming.at(time);
    check.on_time(time);
    for (const auto& p : mesh.positions)
      for (const float x : p) check.put_in(x);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const auto vertex : mesh.triangles[t])
        for (unsigned axis = 0; axis < 3; ++axis) {
          const Box& box = deforming.boxes()[t];
          const float x = mesh.positions[vertex][axis];
          check.expect(box.min[axis] <= x && x <= box.max[axis],
                       "a corner of triangle %zu is at %a on axis %u, outside of its box [%a, %a]", t, double{x}, axis,
                       double{box.min[axis]}, double{box.max[axis]});
        }
    for (unsigned k = 0; k < kRays; ++k) {
      const bool inside = k % 2 == 0;
      const Vec3 from = lattice_point(random, inside ? 128 : 8192), to = target(mesh, random);
      Ray aimed = between(from, to);
      aimed.time = time;
      const auto ray = convert<Real>(aimed);
      check.on_ray(ray);
      const auto expected = try_all<typename P::Triangle>(mesh, ray);
      const auto hit = deforming.hit<P>(ray);
      check.on_hit(hit);
      check.expect(!inside || hit.found(), "leaks");
      expect_same(check, expected, hit, false);
      if (hit.found() && expected.found())
        check.expect(hit.normal == expected.normal && hit.error >= expected.error,
                     "the normal is another, or the error %a is less than that of a mesh that stands still, %a",
                     double{hit.error}, double{expected.error});
    }
  }
  return check.finish(kTimes * kRays / 2);
}

}  // namespace hiprt::flags
