// Still and moving instances against Embree 3.13 in robust mode and against long double. Debian's Embree has one level
// of instances (RTC_MAX_INSTANCE_LEVEL_COUNT is 1), so it gets the product of two levels.

#include <tests/oracle/embree_scene.h>
#include <tests/traversal/triangle_judge.h>
#include <tests/traversal/workers.h>

#include <hiprt_device/math/affine.h>

#include <functional>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr std::uint32_t kInstances = 12;
using Tracer = Moving<Instanced<Policies, 2>>;

/// A matrix in long double; column 3 is the translation.
struct RealAffine {
  Real row[3][4];

  Real3 times(const Real3& p) const {
    Real3 result;
    for (unsigned r = 0; r < 3; ++r) result[r] = row[r][0] * p[0] + row[r][1] * p[1] + row[r][2] * p[2] + row[r][3];
    return result;
  }
  Real3 translation() const { return {row[0][3], row[1][3], row[2][3]}; }
  double condition() const {
    double m[3][3];
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) m[r][c] = static_cast<double>(row[r][c]);
    const Stretches stretches(m);
    return stretches.longest / stretches.shortest;
  }
};

RealAffine real(const Affine& m) {
  RealAffine result;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) result.row[r][c] = m.row[r][c];
  return result;
}

RealAffine product(const RealAffine& a, const RealAffine& b) {
  RealAffine result;
  for (unsigned c = 0; c < 4; ++c) {
    const Real3 column = a.times({b.row[0][c], b.row[1][c], b.row[2][c]});
    for (unsigned r = 0; r < 3; ++r) result.row[r][c] = column[r] - (c == 3 ? 0 : a.row[r][3]);
  }
  return result;
}

RealAffine transform_at(const build::Motion& motion, Real time) {
  RealAffine result;
  const Real3 origin = moved(motion, time, {0, 0, 0});
  for (unsigned c = 0; c < 4; ++c) {
    const Real3 image = moved(motion, time, {c == 0 ? 1.0L : 0.0L, c == 1 ? 1.0L : 0.0L, c == 2 ? 1.0L : 0.0L});
    for (unsigned r = 0; r < 3; ++r) result.row[r][c] = c == 3 ? origin[r] : image[r] - origin[r];
  }
  return result;
}

/// An instance as the judge knows it, and by how much its transform may be off.
struct Placed {
  std::function<RealAffine(Real)> at;
  double magnified = 1.0;  ///< Condition numbers of all levels, multiplied.
  double reach = 0.0;      ///< How far the inner levels' origins are from the outermost instance's.
  double rounding = 0.0, farthest = 0.0;
  bool turning = false;
};

/// The same in both libraries.
struct Both {
  InstanceScene ours;
  EmbreeScene object, theirs;
  std::vector<build::Motion> motions;  ///< Whose addresses `ours` has.
  std::vector<Placed> placed;
  oracle::Mesh mesh = oracle::icosphere(1);
  Vec3 center{0.0f};  ///< Of the rays.

  Both() {
    ours.add_file({mesh}, NodeLayout::kPlanes);
    object.add(mesh);
    object.commit();
    motions.reserve(kInstances);
  }
  void build() {
    ours.build();
    theirs.commit();
    const SceneView view = ours.view();
    for (std::size_t i = 0; view.motions != nullptr && i < placed.size(); ++i) {
      placed[i].rounding = view.motions[i].rounding;
      placed[i].farthest = view.motions[i].farthest;
    }
  }
};

/// What Embree may be off by: it inverts matrices in floats, translation and all, and its turns are approximations.
constexpr double kEmbreeRoundings = 12,
                 kEmbreeAngle = 3e-5;  // The angle: 1e-5 to 1.6e-5, by the instruction set that it chooses.

/// Decision 0014's proof with 16 roundings of a ray's transform and test, and the record of 0015. Of Embree, what
/// inverting a matrix in floats costs.
Tolerances tolerances_of(const Placed& placed, const RealAffine& at, const Ray& ray, double farthest_corner,
                         double extent) {
  const Real3 origin = real3(ray.origin), translation = at.translation();
  const auto from = static_cast<double>(length(origin - translation)) + placed.reach;
  const double condition = placed.magnified > 1.0 ? placed.magnified : at.condition();
  const auto size = static_cast<double>(length(origin) + length(translation)) + placed.reach + farthest_corner;
  const double u = 0x1p-24;
  return {u * (16 * condition * (from + farthest_corner) + 14 * placed.rounding * extent + 6 * placed.farthest),
          u * kEmbreeRoundings * condition * condition * size + (placed.turning ? kEmbreeAngle * extent : 0.0)};
}

void look(const Both& both, const Ray& ray, RayJudge& judge) {
  std::vector<Real3> corners(both.mesh.positions.size());
  for (std::uint32_t i = 0; i < both.placed.size(); ++i) {
    const RealAffine at = both.placed[i].at(ray.time);
    double farthest = 0.0, extent = 0.0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const auto& p = both.mesh.positions[k];
      corners[k] = at.times({p[0], p[1], p[2]});
      farthest = std::max(farthest, static_cast<double>(length(corners[k] - real3(ray.origin))));
      extent = std::max(extent, static_cast<double>(length(corners[k] - at.translation())));
    }
    const Tolerances tolerances = tolerances_of(both.placed[i], at, ray, farthest, extent);
    if (judge.distance(at.translation()) > 1.001L * extent + tolerances.ours + tolerances.theirs) continue;
    for (std::uint32_t t = 0; t < both.mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = both.mesh.triangles[t];
      judge.add(i, t, {corners[a], corners[b], corners[c]}, tolerances);
    }
  }
}

/// t is within the hit's own bounds of the exact one.
bool within_own_bound(const RayJudge& judge, const TracedHit& named, const SceneView& scene, const Ray& ray,
                      const Hit& hit) {
  const MetTriangle* met = judge.met(named);
  if (met == nullptr) return true;
  const Real off = std::fabs(hit.t - met->t);
  return off * met->steepness <= 1.7321L * hit.error && off <= Real{t_error(scene, ray, hit)};
}

/// At a random time in [0, 1]; every other one through a corner or the middle of an edge, as well as floats allow.
Ray ray_in(const Both& both, Random& random) {
  Ray ray = random_ray(random, 6.0);
  ray.origin += both.center;
  ray.time = random.below(8) == 0 ? static_cast<float>(random.below(5)) / 4 : random.uniform_float(0, 1);
  ray.tmax = std::numeric_limits<float>::infinity();
  ray.mask = 0xffffffffu;
  if (random.coin()) return ray;
  const auto& triangle = both.mesh.triangles[random.below(static_cast<std::uint32_t>(both.mesh.triangles.size()))];
  const auto &a = both.mesh.positions[triangle[0]], &b = both.mesh.positions[triangle[1]];
  const Real w = random.coin() ? 0.0L : 0.5L;
  const Real3 target = both.placed[random.below(static_cast<std::uint32_t>(both.placed.size()))].at(ray.time).times(
      {a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1]), a[2] + w * (b[2] - a[2])});
  for (int k = 0; k < 3; ++k)
    ray.direction[k] = static_cast<float>(target[static_cast<std::size_t>(k)] - ray.origin[k]);
  return ray;
}

/// Random rays at random times.
/// @param number of our hit's instance among the judge's instances.
void compare(
    const char* name, const Both& both, unsigned rays,
    const std::function<std::uint32_t(const InstancePath<2>&)>& number = [](const InstancePath<2>& path) {
      return path.instance[0];
    }) {
  const SceneView view = both.ours.view();
  Random random(kSeed);
  SecondOpinion opinion;
  for (unsigned i = 0; i < trials(rays); ++i) {
    const Ray ray = ray_in(both, random);
    RayJudge judge(ray);
    look(both, ray, judge);
    const auto hit = closest_hit<Tracer>(view, ray);
    const EmbreeHit embree = both.theirs.closest(ray);
    const TracedHit ours = hit.found() ? TracedHit{number(hit.path), hit.primitive, hit.t} : TracedHit{};
    const TracedHit theirs = embree.found() ? TracedHit{embree.instance, embree.primitive, embree.t} : TracedHit{};
    opinion.judge(judge, ray, ours, theirs);
    opinion.any_differs += any_hit<Tracer>(view, ray).found() == hit.found() ? 0 : 1;
    INFO(name << ", seed " << kSeed << ", ray " << i);
    if (hit.found()) REQUIRE(within_own_bound(judge, ours, view, ray, hit));
  }
  opinion.check(name);
}

/// Keys at equal distances, in floats without rounding, from before 0 to behind 1, with rotations of length 1.
std::vector<build::MotionKey> even_keys(Random& random, MotionKind kind, unsigned count, double spread,
                                        KeyRange& range) {
  auto keys = random_motion(random, kind, count, spread).keys;
  const std::uint32_t ticks = 64 / (count - 1) + 1 + random.below(20);
  const float step = static_cast<float>(ticks) / 64;
  range.begin = -static_cast<float>(random.below(16)) / 64;
  if (range.begin + step * static_cast<float>(count - 1) < 1.0f)
    range.begin = 1.0f - step * static_cast<float>(count - 1);
  for (unsigned k = 0; k < count; ++k) {
    keys[k].time = range.begin + step * static_cast<float>(k);
    range.end = keys[k].time;
    double square = 0.0;
    for (const float x : keys[k].rotation) square += double{x} * x;
    for (float& x : keys[k].rotation) x = static_cast<float>(x / std::sqrt(square));
  }
  return keys;
}

/// Adds an instance that moves by the parts of its keys, or between matrices.
void add_moving(Both& both, const std::vector<build::MotionKey>& keys, MotionKind kind, const KeyRange& range) {
  build::Motion motion{.kind = kind}, of_judge{.keys = keys, .kind = kind};
  if (kind == MotionKind::kMatrix) {
    std::vector<Affine> matrices;
    for (const build::MotionKey& key : keys) {
      motion.matrices.push_back(build::compose(key));
      matrices.push_back(motion.matrices.back().to_scene);
    }
    both.theirs.add(both.object, matrices, range);
  } else {
    motion.keys = keys;
    both.theirs.add(both.object, keys, range);
  }
  both.motions.push_back(std::move(motion));
  both.ours.groups[0].push_back({.object = 0, .motion = &both.motions.back()});
  both.placed.push_back(
      {.at = [of_judge](Real time) { return transform_at(of_judge, time); }, .turning = kind != MotionKind::kMatrix});
}

/// Instances with one kind of motion.
/// @param change of the keys that were made at random.
void compare_moving(const char* name, MotionKind kind, double spread,
                    const std::function<void(Random&, std::vector<build::MotionKey>&)>& change = {},
                    const Vec3& center = Vec3(0.0f)) {
  Random random(kSeed);
  Both both;
  both.center = center;
  both.ours.groups.emplace_back();
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    KeyRange range;
    auto keys = even_keys(random, kind, 2 + random.below(4), spread, range);
    if (change) change(random, keys);
    add_moving(both, keys, kind, range);
  }
  both.build();
  compare(name, both, 6000);
}

/// The same axis for all keys, and the same turn from key to key.
void turn_by(Random& random, std::vector<build::MotionKey>& keys, double angle) {
  const auto axis = random.on_sphere();
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const build::MotionKey turned = turned_key(0, axis, static_cast<double>(k) * angle);
    std::copy_n(turned.rotation, 4, keys[k].rotation);
  }
}

}  // namespace

TEST_CASE("static instances have Embree's hits, on one level and on two", "[embree]") {
  SecondOpinion::print_header();
  Random random(kSeed);
  Both one, two;
  one.ours.groups.emplace_back(kInstances);
  for (Instance& instance : one.ours.groups[0]) {
    instance.to_scene = random_affine(random, 3.0);
    one.theirs.add(one.object, {&instance.to_scene, 1});
    one.placed.push_back({.at = [at = real(instance.to_scene)](Real) { return at; }});
  }
  one.build();
  compare("still", one, 6000);
  constexpr std::uint32_t kOuter = 4, kInner = 3;
  two.ours.groups = {std::vector<Instance>(kInner), std::vector<Instance>(kOuter, {.object = 1})};
  for (auto& group : two.ours.groups)
    for (Instance& instance : group) instance.to_scene = random_affine(random, 2.0);
  for (const Instance& outer : two.ours.groups[1])
    for (const Instance& inner : two.ours.groups[0]) {
      const RealAffine first = real(outer.to_scene), second = real(inner.to_scene), whole = product(first, second);
      Affine multiplied;
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned c = 0; c < 4; ++c) multiplied.row[r][c] = static_cast<float>(whole.row[r][c]);
      two.theirs.add(two.object, {&multiplied, 1});
      two.placed.push_back({.at = [whole](Real) { return whole; },
                            .magnified = first.condition() * (1 + second.condition()),
                            .reach = static_cast<double>(length(whole.translation() - first.translation()))});
    }
  two.build();
  compare("still, two levels", two, 6000,
          [](const InstancePath<2>& path) { return path.instance[0] * kInner + path.instance[1]; });
}

TEST_CASE("instances that move between matrices have Embree's hits", "[embree]") {
  compare_moving("matrices", MotionKind::kMatrix, 3.0);
  compare_moving(
      "matrices, 1000 away", MotionKind::kMatrix, 3.0,
      [](Random&, std::vector<build::MotionKey>& keys) {
        for (build::MotionKey& key : keys) key.translation[0] += 1000;
      },
      Vec3(1000, 0, 0));
}

TEST_CASE("rotating instances have Embree's hits", "[embree]") {
  compare_moving("turns", MotionKind::kSlerp, 3.0);
  compare_moving(
      "turns, 1000 away", MotionKind::kSlerp, 3.0,
      [](Random&, std::vector<build::MotionKey>& keys) {
        for (build::MotionKey& key : keys) key.translation[0] += 1000;
      },
      Vec3(1000, 0, 0));
  compare_moving("turns of 170 degrees", MotionKind::kSlerp, 3.0,
                 [](Random& random, auto& keys) { turn_by(random, keys, 170 / 57.29577951308232); });
  compare_moving("turns of 2 degrees", MotionKind::kSlerp, 3.0,
                 [](Random& random, auto& keys) { turn_by(random, keys, 2 / 57.29577951308232); });
}

TEST_CASE("Embree's rotations are slerp with a polynomial for the angle; below 3.6 degrees nlerp", "[embree]") {
  std::printf("%-10s %12s %12s %12s\n", "degrees", "ours, slerp", "Embree,slerp", "Embree,nlerp");
  for (const double degrees : {0.01, 1.0, 3.5, 3.7, 10.0, 60.0, 120.0, 175.0}) {
    const std::vector<build::MotionKey> keys{turned_key(0, {0, 0, 1}, 0),
                                             turned_key(1, {0, 0, 1}, degrees / 57.29577951308232)};
    Both both;
    both.ours.groups.emplace_back();
    add_moving(both, keys, MotionKind::kSlerp, {});
    both.build();
    const SceneView view = both.ours.view();
    build::Motion motion{.keys = keys};
    // By how much the angle is off at most.
    double ours = 0.0, slerp = 0.0, nlerp = 0.0;
    for (unsigned i = 0; i <= 1000; ++i) {
      const float time = static_cast<float>(i) / 1000;
      const auto off = [&](Real x, Real y, MotionKind kind) {
        motion.kind = kind;
        const Real3 right = moved(motion, time, {1, 0, 0});
        return static_cast<double>(
            std::fabs(std::remainder(std::atan2(y, x) - std::atan2(right[1], right[0]), 2 * 3.14159265358979323846L)));
      };
      const Vec3 p = point_to_scene(at_time(view.instances[0], view.motions[0], view.base, time), Vec3(1, 0, 0));
      const Affine embree = both.theirs.transform(0, time);
      ours = std::max(ours, off(p.x, p.y, MotionKind::kSlerp));
      slerp = std::max(slerp, off(embree.row[0][0], embree.row[1][0], MotionKind::kSlerp));
      nlerp = std::max(nlerp, off(embree.row[0][0], embree.row[1][0], MotionKind::kNlerp));
    }
    std::printf("%-10g %12.2g %12.2g %12.2g\n", degrees, ours, slerp, nlerp);
    CHECK(ours < 5e-7);
    CHECK(slerp < kEmbreeAngle);
  }
}
