// Hits with AMD's ray instruction have the bits of the software's. The instruction is a model that rounds as badly as
// docs/proofs/ray-instruction.md assumes at most. Without widened boxes the same model loses hits.

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/refit.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/tiered.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 2033;

/// @tparam kAlways whether the instruction tests rays that need the slabs, too.
template <bool kAlways> struct WorstInstruction : HardwareBoxes {
  template <RayInstructionLayout Layout, class Lanes>
  static SortedChildren intersect(const SceneView& scene, NodeRef ref, const Ray& ray, const RaySlabs<Lanes>& slabs,
                                  const Choice& choice, float limit) {
    if (!kAlways && choice.rare != 0) return sorted_by_slabs<Layout>(scene, ref, ray, slabs, limit);
    return intersect_usual<Layout>(scene, ref, ray, slabs, choice, limit);
  }
  template <RayInstructionLayout Layout, class Lanes>
  static SortedChildren intersect_usual(const SceneView& scene, NodeRef ref, const Ray& ray,
                                        const RaySlabs<Lanes>& slabs, const Choice&, float limit) {
    const auto& node = *reinterpret_cast<const typename Layout::Node*>(scene.base + ref_offset(ref));
    SortedChildren sorted{{kInvalidRef, kInvalidRef, kInvalidRef, kInvalidRef}};
    unsigned count = 0;
    for (unsigned i = 0; i < kBranching; ++i)
      if (node.child[i] != kInvalidRef && meets(Layout::box(node, i), ray, slabs, limit))
        sorted.child[count++] = node.child[i];
    return sorted;
  }

 private:
  template <class Lanes> static bool meets(const Box& box, const Ray& ray, const RaySlabs<Lanes>& slabs, float limit) {
    double first = 0, last = limit;
    for (unsigned k = 0; k < 3; ++k) {
      const double rcp = Lanes::value(slabs.rcp[k]), from = ray.origin[static_cast<int>(k)];
      const auto distance = [&](double plane, double side) {
        const double error =
            0x1p-24 * std::abs(rcp) * (7 * std::abs(plane - from) + 6 * (std::abs(plane) + std::abs(from)));
        return (plane - from) * rcp + side * error;
      };
      first = std::max(first, distance(rcp < 0 ? box.max[k] : box.min[k], 1));
      last = std::min(last, distance(rcp < 0 ? box.min[k] : box.max[k], -1));
    }
    return first <= last;
  }
};

template <class LayoutType, bool kAlways = false> struct Modelled : Policies {
  using Layout = LayoutType;
  using Boxes = WorstInstruction<kAlways>;
  using Lanes = ArrayLanes;
  using ClosestOrder = AsTested;
  using AnyOrder = AsTested;
};

/// With a stack that has usual steps (StackBacktrack::is_usual()), in memory so small that many steps are not usual.
template <class LayoutType> struct ModelledTiered : Modelled<LayoutType> { using Stack = TieredStack<3>; };

/// Calls use(storage...) with what the queries of P need besides scene and ray.
template <class P, class Use> auto with_stack(Use&& use) {
  if constexpr (requires { P::Stack::kEntriesPerThread; }) {
    StackEntry shared[P::Stack::kEntriesPerThread];
    typename P::Stack::Memory memory;
    return use(typename P::Stack::Storage(shared, 0, 1, memory));
  } else {
    return use();
  }
}

struct Sum {
  std::uint64_t rays = 0, hits = 0, by_slabs = 0, different = 0;
  std::string first;
};

/// A ray of any kind: aimed at edges from inside, from far outside, or along axes.
Ray any_ray(const Closed& closed, Random& random) {
  Ray ray = aimed_ray(closed, random, 1e6);
  const unsigned kind = random.below(4);
  if (kind == 0) {
    // From outside, up to 100 sizes away: a third of these need the slabs.
    const Double3 to = target_point(closed.mesh, random), away = random.on_sphere();
    const double distance = closed.scale * random.log_uniform(0.1, 100);
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      ray.origin[k] = static_cast<float>(to[i] + distance * away[i]);
      ray.direction[k] = static_cast<float>(to[i] - double{ray.origin[k]});
    }
  } else if (kind == 1) {
    const Position& to = closed.mesh.positions[random.below(static_cast<std::uint32_t>(closed.mesh.positions.size()))];
    const unsigned axis = random.below(3);
    for (unsigned k = 0; k < 3; ++k) {
      const int i = static_cast<int>(k);
      if (k != axis) ray.origin[i] = to[k];
      ray.direction[i] = k == axis ? (random.coin() ? 1.0f : -1.0f) : random.coin() ? 0.0f : -0.0f;
    }
  }
  if (random.below(4) == 0) ray.tmax = static_cast<float>(random.unit()) * 2.0f;
  return ray;
}

template <class P> Sum compare(const Scene& scene, const Closed& closed, unsigned rays) {
  using Software = WithLayout<typename P::Layout>;
  Random random(kSeed);
  Sum sum;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = any_ray(closed, random);
    const Hit expected = closest_hit<Software>(scene.traced, ray);
    const Hit hit = with_stack<P>([&](const auto&... stack) { return closest_hit<P>(scene.traced, ray, stack...); });
    const bool any =
        with_stack<P>([&](const auto&... stack) { return any_hit<P>(scene.traced, ray, stack...).found(); });
    ++sum.rays;
    sum.hits += expected.found() ? 1 : 0;
    sum.by_slabs += HardwareBoxes::Choice(scene.traced, ray.origin).rare != 0 ? 1 : 0;
    if (same_hit(expected, hit) && any == expected.found()) continue;
    if (sum.different++ == 0) sum.first = describe(ray);
  }
  return sum;
}

struct Placement {
  double scale;
  Double3 offset;
};

constexpr unsigned kRays = 2000;

}  // namespace

TEST_CASE("widened boxes: the ray instruction at its worst finds the software's hits") {
  std::uint64_t rays = 0, hits = 0, by_slabs = 0;
  for (const Closed& shape : closed_meshes())
    for (const Placement& at : {Placement{1, {0, 0, 0}}, Placement{1e-15, {0, 0, 0}}, Placement{1e15, {0, 0, 0}},
                                Placement{10, {1e3, -1e3, 1e3}}, Placement{1e3, {148376, 1234, -223423}}}) {
      const Closed closed = placed(shape, at.scale, at.offset);
      for (const build::Builder builder : {build::Builder::kHq, build::Builder::kLbvh}) {
        const Scene scene =
            make_scene({closed.mesh},
                       {.builder = builder, .nodes = NodeLayout::kFloat, .max_leaf_triangles = 2, .widen_boxes = true});
        INFO(closed.name << ", scale " << at.scale << ", " << scene.name << ", seed " << kSeed);
        REQUIRE(scene.traced.box_margin > 0);
        const Sum sum = compare<Modelled<FloatLayout>>(scene, closed, kRays);
        INFO(sum.first);
        CHECK(sum.different == 0);
        CHECK(compare<ModelledTiered<FloatLayout>>(scene, closed, kRays).different == 0);
        rays += sum.rays, hits += sum.hits, by_slabs += sum.by_slabs;
      }
    }
  std::printf("%llu rays, %llu hits, %llu by slabs\n", static_cast<unsigned long long>(rays),
              static_cast<unsigned long long>(hits), static_cast<unsigned long long>(by_slabs));
  CHECK(hits > rays / 2);
  CHECK(by_slabs > rays / 100);
  CHECK(by_slabs < rays / 2);
}

TEST_CASE("widened boxes: half nodes, and a file without them takes the slabs for every ray") {
  const Closed closed = closed_meshes()[0];
  const Scene half = make_scene({closed.mesh}, {.nodes = NodeLayout::kHalf, .widen_boxes = true});
  CHECK(compare<Modelled<HalfLayout>>(half, closed, kRays).different == 0);
  const Scene plain = make_scene({closed.mesh}, {.nodes = NodeLayout::kFloat});
  const Sum sum = compare<Modelled<FloatLayout>>(plain, closed, kRays);
  CHECK(sum.different == 0);
  CHECK(sum.by_slabs == sum.rays);
}

TEST_CASE("widened boxes: without them the same model loses hits") {
  const Closed closed = placed(closed_meshes()[4], 10, {1e3, -1e3, 1e3});
  const Scene plain = make_scene({closed.mesh}, {.nodes = NodeLayout::kFloat});
  CHECK(compare<Modelled<FloatLayout, true>>(plain, closed, kRays).different > 0);
}

TEST_CASE("widened boxes: files are valid, and boxes are wide enough for their margin and no more") {
  const Mesh mesh = icosphere(3);
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kHalf})
    for (const build::Builder builder : typical_builders()) {
      const Scene scene = make_scene({mesh}, {.builder = builder, .nodes = layout, .widen_boxes = true});
      INFO(scene.name);
      CHECK((scene.view.header->features & feature_bit(Feature::kWidenedBoxes)) != 0);
      CHECK(scene.traced.box_margin == scene.view.header->box_margin);
      const auto valid = validate(std::as_const(scene.bvh.buffer).bytes());
      REQUIRE(valid.has_value());
    }
}

TEST_CASE("widened boxes: a file whose header says another margin is refused") {
  const Scene scene = make_scene({icosphere(2)}, {.nodes = NodeLayout::kFloat, .widen_boxes = true});
  const auto fault = [&](float margin) {
    build::Buffer copy(scene.bvh.buffer.size());
    const auto bytes = copy.bytes();
    std::copy_n(std::as_const(scene.bvh.buffer).bytes().data(), bytes.size(), bytes.data());
    auto& header = *reinterpret_cast<FileHeader*>(bytes.data());
    header.box_margin = margin;
    header.checksum = file_checksum(bytes);
    const auto valid = validate(bytes);
    return valid ? kFormatErrors : static_cast<std::size_t>(valid.error().error);
  };
  CHECK(fault(scene.traced.box_margin) == kFormatErrors);
  CHECK(fault(2 * scene.traced.box_margin) == static_cast<std::size_t>(FormatError::kBoxNotContained));
  for (const float margin : {0.0f, -1.0f, std::numeric_limits<float>::infinity(), std::nanf("")})
    CHECK(fault(margin) == static_cast<std::size_t>(FormatError::kBadBoxMargin));
}

TEST_CASE("widened boxes: a refit widens the new boxes by the new margin") {
  const std::vector<Mesh> before{icosphere(3)};
  const std::vector<Mesh> after{oracle::placed(before[0], 5, {1, 2, 3})};
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kHalf}) {
    const Scene scene = make_scene(before, {.nodes = layout, .widen_boxes = true});
    const auto views = oracle::views(after);
    const auto moved = build::refit_copy(std::as_const(scene.bvh.buffer).bytes(), {.meshes = views});
    REQUIRE(moved.has_value());
    const auto bytes = std::as_const(moved->buffer).bytes();
    REQUIRE(validate(bytes).has_value());
    CHECK(open_buffer(bytes)->header->box_margin > 4 * scene.traced.box_margin);
  }
}

TEST_CASE("widened boxes: only layouts float and half, and scenes that have a margin") {
  const std::vector<Mesh> meshes{icosphere(2)};
  const auto refused = build::build(oracle::views(meshes), {.widen_boxes = true});
  REQUIRE(!refused.has_value());
  CHECK(refused.error().message == "widen_boxes needs node layout float or half");
  const std::vector<Mesh> huge{oracle::placed(meshes[0], 1e38, {0, 0, 0})};
  const Scene scene = make_scene(huge, {.nodes = NodeLayout::kFloat, .widen_boxes = true});
  CHECK(scene.traced.box_margin == 0.0f);
  CHECK(validate(std::as_const(scene.bvh.buffer).bytes()).has_value());
}
