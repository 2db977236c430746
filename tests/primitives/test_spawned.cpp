// Rays spawned at a hit: outside, they do not hit the primitive again; inside, they leave it once.

#include <hiprt_device/query/spawn.h>
#include <tests/primitives/measure.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20270301;
/// The distance moved, in CustomHit::error: sqrt(3) for a normal along a diagonal, and 1 for the rounding of the sum.
constexpr double kMaxMove = 2.74;

struct SpawnFindings {
  std::uint64_t outward = 0, again = 0, inward = 0, not_once = 0;
  double move = 0;
  std::string first_failure;

  void add(const SpawnFindings& other) {
    outward += other.outward, again += other.again, inward += other.inward, not_once += other.not_once;
    move = std::max(move, other.move);
    if (first_failure.empty()) first_failure = other.first_failure;
  }
};

/// Any direction, one nearly tangential to the surface, or one along a curve's straight lines.
Point direction_from(const Case& c, const CustomHit& hit, Random& random) {
  const unsigned kind = random.below(3);
  Point d = random.on_sphere();
  if (kind == 0) return d;
  if (kind == 1 && !c.is_sphere) {
    d = walk(point(c.b.position), -1, point(c.a.position));
    const double largest = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
    if (largest == 0) return random.on_sphere();
    for (double& x : d) x /= random.coin() ? largest : -largest;
  }
  const Point n = point(hit.normal);
  const double along = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
  return walk(d, -along + random.uniform(-1, 1) * random.log_uniform(1e-9, 1e-5), n);
}

void spawn(const Case& c, const CustomHit& custom, Random& random, SpawnFindings& findings) {
  Hit hit;
  hit.t = custom.t;
  hit.normal = custom.normal;
  hit.error = custom.error;
  Case next = c;
  next.ray = Ray{};
  const double length = random.log_uniform(1e-3, 1e3);
  next.ray.direction = rounded(walk(Point{0, 0, 0}, length, direction_from(c, custom, random)));
  if (max_component(next.ray.direction) == 0.0f) return;
  next.ray.origin = spawn_origin(c.ray, hit, next.ray.direction);
  const bool is_outward = spawn_detail::dot(hit.normal / max_component(hit.normal), next.ray.direction) >= 0.0f;
  unsigned crossings = 0;
  intersect(next, next.ray, [&](const CustomHit&) {
    ++crossings;
    return true;
  });
  const LineAndBalls in = exact_terms(next);
  const Real3 from = plus(real3(point(c.ray.origin)), custom.t, real3(point(c.ray.direction)));
  const Real3 to = real3(in.origin);
  findings.move = std::max(findings.move, static_cast<double>(norm(minus(to, from)) / custom.error));
  bool is_bad = false;
  if (is_outward) {
    ++findings.outward;
    is_bad = crossings != 0;
    findings.again += is_bad ? 1 : 0;
  } else if (distance_to_surface(in, to).value < -0x1p-46L * size_of(in)) {
    // Not where the primitive is thinner than the error, and the ray starts on its other side.
    ++findings.inward;
    is_bad = crossings != 1;
    findings.not_once += is_bad ? 1 : 0;
  }
  if (is_bad && findings.first_failure.empty()) findings.first_failure = describe(c) + "\nspawned: " + describe(next);
}

SpawnFindings spawn_many(Shape shape, const Scales& scales, unsigned count) {
  constexpr unsigned kBlock = 500;
  const auto work = [&](std::size_t block, SpawnFindings& findings) {
    Random random(Random(kSeed + (static_cast<std::uint64_t>(shape) << 56 | block << 16)).bits());
    for (unsigned i = 0; i < kBlock; ++i) {
      const Case c = random_case(shape, kAims[random.below(std::size(kAims))], scales.varied(random), random);
      intersect(c, c.ray, [&](const CustomHit& hit) {
        for (int k = 0; k < 2; ++k) spawn(c, hit, random, findings);
        return true;
      });
    }
  };
  SpawnFindings sum;
  for (const SpawnFindings& part : for_each_parallel<SpawnFindings>(count / kBlock + 1, work)) sum.add(part);
  return sum;
}

}  // namespace

TEST_CASE("spawned rays do not meet the primitive they leave", "[primitives]") {
  INFO("seed " << kSeed);
  const Scales settings[] = {{}, {.offset = 100}, {.distance = 1e6}};
  std::uint64_t outward = 0;
  std::printf("\n%-15s %9s %7s %9s %9s %7s\n", "shape", "outward", "again", "inward", "not once", "move");
  for (const Shape shape : kShapes) {
    SpawnFindings sum;
    for (const Scales& scales : settings) sum.add(spawn_many(shape, scales, trials(50000)));
    std::printf("%-15s %9lu %7lu %9lu %9lu %7.3f\n", name(shape), sum.outward, sum.again, sum.inward, sum.not_once,
                sum.move);
    INFO(name(shape) << "\n" << sum.first_failure);
    CHECK(sum.again == 0);
    CHECK(sum.not_once == 0);
    CHECK(sum.move <= kMaxMove);
    CHECK(sum.inward > sum.outward / 4);
    outward += sum.outward;
  }
  std::printf("%lu rays spawned outwards\n", outward);
  CHECK(outward >= trials(1000000));
}
