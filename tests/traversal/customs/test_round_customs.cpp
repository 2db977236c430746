// The library's spheres and round curves in a tree: every query gives the result of a loop over all shapes, ties
// included.

#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/customs/custom_shapes.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <functional>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 7121;

/// A functor that is compiled once, not in every query.
template <class Set> struct OutOfLine {
  Set set;

  [[gnu::noinline]] bool intersect_out_of_line(const Ray& ray, float tmin, float tmax, std::uint32_t primitive,
                                               const std::function<bool(const CustomHit&)>& report) const {
    return set.intersect(ray, tmin, tmax, primitive, report);
  }
  template <class Report>
  bool intersect(const Ray& ray, float tmin, float tmax, std::uint32_t primitive, Report&& report) const {
    return intersect_out_of_line(ray, tmin, tmax, primitive, [&](const CustomHit& hit) { return report(hit); });
  }
};

using Round = PrimitiveList<OutOfLine<SphereSet>, OutOfLine<RoundCurveSet>>;

/// Strands of hair whose segments share a ball that both report; spheres, each twice; a mesh between them.
struct RoundWorld {
  double size;
  std::vector<Sphere> spheres;
  std::vector<CurveVertex> vertices;
  std::vector<std::uint32_t> first_vertex;
  CustomWorld world;

  explicit RoundWorld(double scale) : size(scale) {
    Random random(kSeed);
    for (int i = 0; i < 60; ++i) {
      const Position center = random.in_cube(size);
      const Sphere sphere{{center[0], center[1], center[2]}, static_cast<float>(size * random.log_uniform(1e-3, 0.5))};
      spheres.insert(spheres.end(), {sphere, sphere});
    }
    for (int strand = 0; strand < 40; ++strand) add_strand(random);
    std::vector<Box> balls, segments;
    for (const Sphere& sphere : spheres) balls.push_back(SphereSet::bounds(sphere));
    for (const std::uint32_t first : first_vertex)
      segments.push_back(RoundCurveSet::bounds(vertices[first], vertices[first + 1]));
    world.meshes = {soup(100, size, kSeed)};
    world.add(std::move(balls), 0);
    world.add(std::move(segments), 1);
  }

  Round shapes() const { return {{{spheres.data()}}, {{vertices.data(), first_vertex.data()}}}; }

  /// At a joint, a sphere or nowhere in particular.
  Ray ray(Random& random) const {
    const Position from = random.in_cube(2 * size), to = random.in_cube(size);
    const CurveVertex& joint = vertices[random.below(static_cast<std::uint32_t>(vertices.size()))];
    const Sphere& sphere = spheres[random.below(static_cast<std::uint32_t>(spheres.size()))];
    const unsigned aim = random.below(3);
    Ray ray;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      ray.origin[k] = from[i];
      ray.direction[k] = (aim == 0 ? joint.position[k] : aim == 1 ? sphere.center[k] : to[i]) - from[i];
    }
    if (random.below(4) == 0) ray.tmin = random.uniform_float(-1.0, 1.0);
    if (random.below(4) == 0) ray.tmax = random.uniform_float(0.0, 2.0);
    return ray;
  }

 private:
  void add_strand(Random& random) {
    const Position root = random.in_cube(size);
    for (int joint = 0; joint < 6; ++joint) {
      const Position bend = random.in_cube(0.2 * size);
      CurveVertex vertex{};
      for (std::size_t k = 0; k < 3; ++k)
        vertex.position[k] = root[k] + bend[k] + 0.1f * static_cast<float>(size) * static_cast<float>(joint);
      vertex.radius = static_cast<float>(size * random.log_uniform(1e-4, 0.1));
      if (joint < 5) first_vertex.push_back(static_cast<std::uint32_t>(vertices.size()));
      vertices.push_back(vertex);
    }
  }
};

/// How many hits of different primitives share their t with the one before.
std::size_t count_ties(const std::vector<Hit>& sorted_hits) {
  std::size_t ties = 0;
  for (std::size_t i = 1; i < sorted_hits.size(); ++i)
    ties += sorted_hits[i].t == sorted_hits[i - 1].t && sorted_hits[i].primitive != sorted_hits[i - 1].primitive;
  return ties;
}

template <class P> void check(const RoundWorld& round, const build::BuildOptions& options, unsigned rays) {
  const Scene scene = round.world.scene(options);
  const Round shapes = round.shapes();
  Random random(kSeed + 1);
  std::size_t hits = 0, ties = 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = round.ray(random);
    const std::vector<Hit> expected = round.world.every_hit(ray, shapes);
    INFO(scene.name << ", size " << round.size << ", seed " << kSeed << ", ray " << i << "\n" << describe(ray));
    REQUIRE(find_fault(Queries<P, NoFilter, Round>{scene.traced, {}, shapes}, ray, expected) == "");
    hits += expected.size();
    ties += count_ties(expected);
  }
  CHECK(hits > 2 * rays);
  CHECK(ties > rays);
}

}  // namespace

TEST_CASE("spheres and round curves in every layout", "[custom]") {
  for (const double size : {1.0, 1e-12, 1e9}) {
    const RoundWorld round(size);
    check<Tried<PlanesLayout>>(round, {.nodes = NodeLayout::kPlanes}, trials(300));
    check<Tried<FloatLayout>>(round, {.nodes = NodeLayout::kFloat}, trials(100));
    check<Tried<HalfLayout>>(round, {.nodes = NodeLayout::kHalf}, trials(100));
    check<Tried<QuantizedLayout>>(round, {.nodes = NodeLayout::kQuantized}, trials(100));
  }
}

TEST_CASE("spheres and round curves under other builders, schedules, lanes and stacks", "[custom]") {
  const RoundWorld round(3.0);
  for (const build::Builder builder : typical_builders())
    check<Tried<PlanesLayout>>(round, {.builder = builder, .max_leaf_triangles = 1}, trials(100));
  check<Tried<PlanesLayout, Postponed, ArrayLanes>>(round, {}, trials(100));
  check<Tried<PlanesLayout, Immediate, DefaultLanes, RestartStack<2>>>(round, {}, trials(100));
}
