// Deforming meshes against Embree 3.13 in robust mode and against long double.

#include <tests/oracle/embree_scene.h>
#include <tests/oracle/motions.h>
#include <tests/traversal/triangle_judge.h>
#include <tests/traversal/workers.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/primitives/moving_triangle.h>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Mesh;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;

/// The same in both libraries: keys at equal distances in time.
struct Deforming {
  std::vector<Mesh> keys;
  KeyRange range;
  std::vector<float> times, positions;
  std::vector<std::uint32_t> triangles;
  build::Buffer file;
  EmbreeScene embree;

  Deforming(std::vector<Mesh> of_keys, const KeyRange& of_range) : keys(std::move(of_keys)), range(of_range) {
    const auto count = static_cast<float>(keys.size() - 1);
    for (std::size_t k = 0; k < keys.size(); ++k) {
      times.push_back(range.begin + (range.end - range.begin) * static_cast<float>(k) / count);
      for (const auto& p : keys[k].positions) positions.insert(positions.end(), p.begin(), p.end());
    }
    for (const auto& t : keys[0].triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    std::vector<Box> boxes;
    for (std::uint32_t i = 0; i < keys[0].triangles.size(); ++i) boxes.push_back(set().bounds(i));
    const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
    auto bvh = build::build(build::SceneInput{{}, geometry}, {.builder = build::Builder::kHploc});
    REQUIRE(bvh.has_value());
    file = std::move(bvh->buffer);
    embree.add(keys, range);
    embree.commit();
  }
  MovingTriangleSet set() const {
    return {{positions.data(), times.data(), triangles.data(), static_cast<std::uint32_t>(keys[0].positions.size()),
             static_cast<std::uint32_t>(keys.size())}};
  }
  /// Vertex @p i at a time.
  Real3 at(std::size_t i, Real time) const {
    std::size_t k = 0;
    while (k + 2 < times.size() && times[k + 1] <= time) ++k;
    const Real s = (time - times[k]) / (Real{times[k + 1]} - times[k]);
    Real3 result;
    for (std::size_t axis = 0; axis < 3; ++axis)
      result[axis] = (1 - s) * keys[k].positions[i][axis] + s * keys[k + 1].positions[i][axis];
    return result;
  }
};

/// The roundings of a triangle test (decision 0003) and of the vertices. Embree's are the same, plus its time's.
Tolerances tolerances_of(const std::array<Real3, 3>& corners, const Ray& ray, double magnitude) {
  double farthest = 0.0;
  for (const Real3& p : corners) farthest = std::max(farthest, static_cast<double>(length(p - real3(ray.origin))));
  const double u = 0x1p-24;
  return {u * (8 * farthest + 8 * magnitude), u * (16 * farthest + 16 * magnitude)};
}

void compare(const char* name, const Deforming& deforming, unsigned rays) {
  const SceneView view = make_scene_view(*open_buffer(deforming.file.bytes()));
  using List = PrimitiveList<MovingTriangleSet>;
  using P = Policies;
  double magnitude = 0.0;
  for (const float x : deforming.positions) magnitude = std::max(magnitude, 1.7321 * std::fabs(double{x}));
  Random random(kSeed);
  SecondOpinion opinion;
  std::vector<Real3> positions(deforming.keys[0].positions.size());
  for (unsigned i = 0; i < trials(rays); ++i) {
    Ray ray = random_ray(random, 4.0);
    ray.time = random.below(8) == 0 ? static_cast<float>(random.below(5)) / 4 : random.uniform_float(0, 1);
    ray.tmax = std::numeric_limits<float>::infinity();
    ray.mask = 0xffffffffu;
    for (std::size_t k = 0; k < positions.size(); ++k) positions[k] = deforming.at(k, ray.time);
    if (random.coin()) {
      // Through a corner, as well as floats allow.
      const Real3& corner = positions[random.below(static_cast<std::uint32_t>(positions.size()))];
      for (int axis = 0; axis < 3; ++axis)
        ray.direction[axis] = static_cast<float>(corner[static_cast<std::size_t>(axis)] - ray.origin[axis]);
    }
    RayJudge judge(ray);
    for (std::uint32_t t = 0; t < deforming.keys[0].triangles.size(); ++t) {
      const auto& [a, b, c] = deforming.keys[0].triangles[t];
      const std::array<Real3, 3> corners{positions[a], positions[b], positions[c]};
      judge.add(0, t, corners, tolerances_of(corners, ray, magnitude));
    }
    P::Stack::Memory memory;
    const Hit hit =
        ClosestHit<P, NoFilter, List>(view, ray, P::Stack::Storage(memory), {}, List{deforming.set()}).next_hit();
    const EmbreeHit embree = deforming.embree.closest(ray);
    const TracedHit ours = hit.found() ? TracedHit{0, hit.primitive, hit.t} : TracedHit{};
    opinion.judge(judge, ray, ours, embree.found() ? TracedHit{0, embree.primitive, embree.t} : TracedHit{});
    const MetTriangle* met = judge.met(ours);
    INFO(name << ", seed " << kSeed << ", ray " << i);
    if (met != nullptr) REQUIRE(std::fabs(hit.t - met->t) * met->steepness <= 1.7321L * hit.error);
  }
  opinion.check(name);
}

}  // namespace

TEST_CASE("a deforming mesh has Embree's hits", "[embree]") {
  SecondOpinion::print_header();
  const Mesh ball = oracle::icosphere(2), torus = oracle::torus(24, 12, 0.4);
  compare("deforming ball", {{ball, oracle::twisted(ball, 0.2), oracle::shaken(ball, 0.3, kSeed)}, {-0.25f, 1.25f}},
          4000);
  compare("deforming torus", {{torus, oracle::twisted(torus, 0.3)}, {0, 1}}, 4000);
  Mesh far = oracle::placed(ball, 1, {0.5, 0.5, 0.5});
  compare("flying ball", {{ball, far, ball, far, ball}, {0, 1}}, 4000);
}
