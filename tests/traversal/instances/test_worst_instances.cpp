// The same searches through instances: no bound is exceeded, and no box hides a hit of its instance.

#include <tests/traversal/directed.h>

#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_device/instances/instance_path.h>
#include <hiprt_device/instances/instance_surface.h>
#include <hiprt_device/instances/transform.h>
#include <hiprt_device/intersect/double_triangle_test.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/spawn.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// A triangle in an instance, whose record is made of twelve more genes.
template <class Real> struct Placed {
  Case it;
  InstanceRecord record{};
  BasicRay<Real> ray, local;  ///< As the scene and as the object have it.
};

/// Nothing where numbers leave the range.
template <class Real> std::optional<Placed<Real>> placed_case(const Genes& genes) {
  Placed<Real> placed;
  InstanceRecord& record = placed.record;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) record.linear[r][c] = genes[14 + 3 * r + c];
    record.translation[r] = genes[23 + r];
  }
  const LinearInverse inverse(record);
  const auto it = case_of(genes);
  if (!inverse.exists() || !(inverse.norm() < 0x1p20) || !it) return {};
  placed.it = *it;
  // The genes' ray is the object's; the scene's is where the inverse takes it, rounded.
  Ray outside;
  outside.origin = point_to_scene(record, it->ray.origin);
  outside.direction = vector_to_scene(record, it->ray.direction);
  if (!is_valid(outside) || max_component(outside.origin) > 0x1p40f || max_component(outside.direction) < 0x1p-40f)
    return {};
  placed.ray = convert<Real>(outside);
  placed.local = ray_to_object(record, placed.ray);
  return placed;
}

/// Of the instance's box in the scene, as tight as the object's corners allow.
template <class Test, class Real> double instance_margin_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto& [it, record, ray, local] = *placed;
  const auto hit = hit_of<Test>(it.corners, local);
  if (!hit || !(hit->t <= std::numeric_limits<Real>::max())) return -1.0;
  const StillInstanceBounds to_scene(record);
  Box around = format_detail::empty_box();
  for (const Position& p : {it.corners.p0, it.corners.p1, it.corners.p2}) {
    const Box corner = to_scene.bounds({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
    for (std::size_t k = 0; k < 3; ++k) {
      around.min[k] = std::min(around.min[k], corner.min[k]);
      around.max[k] = std::max(around.max[k], corner.max[k]);
    }
  }
  format_detail::InstanceNeeds needs;
  needs.add(record, ObjectRecord{});
  return box_share<Real>(ray, around, hit->t, affine_detail::round_up(needs.condition),
                         affine_detail::round_up(needs.reach));
}

/// Of the triangle's box in the object's own tree.
template <class Test, class Real> double inner_margin_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto hit = hit_of<Test>(placed->it.corners, placed->local);
  if (!hit || !(hit->t <= std::numeric_limits<Real>::max())) return -1.0;
  return box_share<Real>(placed->local, box_of(placed->it.corners), hit->t, 0.0f, 0.0f);
}

/// The hit point's distance from the triangle's plane in the scene, per axis, in Hit::error.
template <class Test, class Real> double placed_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto& [it, record, ray, local] = *placed;
  const auto in_object = hit_of<Test>(it.corners, local);
  if (!in_object) return -1.0;
  ObjectRecord object{};
  SceneView scene;
  alignas(64) const std::byte nothing[64] = {};
  scene.base = nothing;
  scene.instances = &record;
  scene.objects = &object;
  BasicPathHit<Real, 1> hit;
  static_cast<BasicHit<Real>&>(hit) = *in_object;
  hit.path = {1, {0}};
  complete_along<false>(scene, hit, ray, [](const BasicRay<Real>&, const std::byte*) {});

  // The object's ray, exactly.
  const auto exact_of = [](double x) { return Rational(x); };
  std::array<Rational, 3> o, d, from, n;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const Rational entry = exact_of(double{record.linear[r][c]});
      o[static_cast<std::size_t>(r)] +=
          entry * (exact_of(double{ray.origin[c]}) - exact_of(double{record.translation[c]}));
      d[static_cast<std::size_t>(r)] += entry * exact_of(double{ray.direction[c]});
    }
  const Position &a = it.corners.p0, &b = it.corners.p1, &c = it.corners.p2;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = (exact_of(b[i]) - exact_of(a[i])) * (exact_of(c[j]) - exact_of(a[j])) -
           (exact_of(b[j]) - exact_of(a[j])) * (exact_of(c[i]) - exact_of(a[i]));
    from[k] = o[k] + Rational(double{hit.t}) * d[k] - exact_of(a[k]);
  }
  Rational off, sum;
  for (std::size_t k = 0; k < 3; ++k) off += n[k] * from[k];
  for (std::size_t column = 0; column < 3; ++column) {
    Rational along;
    for (std::size_t row = 0; row < 3; ++row) along += exact_of(double{record.linear[row][column]}) * n[row];
    sum += abs(along);
  }
  if (sgn(sum) == 0) return -1.0;
  return Rational(abs(off) / sum / Rational(double{hit.error})).get_d();
}

Genes make_placed_genes(Random& random) {
  Genes genes = make_genes(random);
  for (unsigned i = 0; i < 9; ++i) genes.push_back(random.uniform_float(-2, 2));
  const double away = random.log_uniform(1e-2, 1e5);
  for (unsigned i = 0; i < 3; ++i) genes.push_back(static_cast<float>(away * random.uniform(-1, 1)));
  return genes;
}

/// small_genes() in an instance that neither turns nor scales much. Its translation is not a multiple of 2^-23.
Genes small_placed_genes(Random& random) {
  Genes genes = small_genes(random);
  for (unsigned i = 0; i < 9; ++i) genes.push_back(i % 4 == 0 ? just_above(random, 1.0f) : 0.0f);
  for (unsigned i = 0; i < 3; ++i) genes.push_back(static_cast<float>(0x1p-23 * random.uniform(-400, 400)));
  return genes;
}

}  // namespace

TEST_CASE("no search breaks the bound of a point in an instance", "[worst_cases]") {
  search_genes("Watertight in an instance", make_placed_genes, placed_share<Watertight, float>);
  search_genes("WatertightDouble in an instance", make_placed_genes, placed_share<WatertightDouble, double>);
}

TEST_CASE("no search makes a box hide a hit in an instance: the instance's box, or one of its object's tree",
          "[worst_cases]") {
  search_genes("Watertight: an instance's margin", make_placed_genes, instance_margin_share<Watertight, float>);
  search_genes("Reference: an instance's margin", make_placed_genes, instance_margin_share<Reference, float>);
  search_genes("Double: an instance's margin", make_placed_genes, instance_margin_share<WatertightDouble, double>);
  search_genes("Watertight: an inner margin", make_placed_genes, inner_margin_share<Watertight, float>);
  search_genes("Reference: an inner margin", make_placed_genes, inner_margin_share<Reference, float>);
  search_genes("Double: an inner margin", make_placed_genes, inner_margin_share<WatertightDouble, double>);
}

TEST_CASE("directed searches reach these parts of the bounds of instances, and none breaks them", "[worst_cases]") {
  search_directed("Watertight in an instance", 8, 2000, 0.07, small_placed_genes, placed_share<Watertight, float>);
  search_directed("Watertight: an instance's margin", 40, 5000, 0.035, small_placed_genes,
                  flat(instance_margin_share<Watertight, float>));
  search_directed("Watertight: an inner margin", 40, 5000, 0.15, small_placed_genes,
                  flat(inner_margin_share<Watertight, float>));
}
