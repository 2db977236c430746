/// libFuzzer target: validate() rejects the bytes, or rays trace through them without harm. An input is a plain .bvh
/// file: any file can be a seed, and bvhinfo reads what the fuzzer finds.

#include "../format/test_scene.h"
#include "mutate.h"
#include "rays.h"

#include <hiprt_build/format/validate.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

using namespace hiprt;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

/// Like assert, but there in release builds too.
void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "fuzz_bvh: %s\n", what);
  std::abort();
}

void check_hit(const BufferView& view, const Ray& ray, const Hit& hit) {
  if (!hit.found()) return;
  require(hit.geometry < view.geometries.size(), "hit names no geometry");
  require(hit.primitive < view.geometries[hit.geometry].primitive_count, "hit names no primitive");
  require((view.geometries[hit.geometry].mask & ray.mask) != 0, "hit of a masked geometry");
  const std::uint64_t number = view.geometries[hit.geometry].first_primitive + hit.primitive;
  require(view.primitive_map[number] != kInvalidId, "hit of a dropped primitive");
  require(hit.t >= ray.tmin && hit.t >= 0.0f && hit.t <= ray.tmax && std::isfinite(hit.t),
          "hit outside the ray's interval");
}

/// The levels that the queries below have.
constexpr unsigned kLevels = 4;
constexpr unsigned kStack = 1024;
/// Of the default policies.
constexpr unsigned kFlatStack = 192;
static_assert(std::is_same_v<PrivateStack<>, PrivateStack<kFlatStack>>);

/// The query's hit. STACKS.md: stack_bound + 3 entries are always enough.
template <class Query> auto hit_within(Query query, const SceneView& scene, unsigned stack) {
  const auto hit = query.next_hit();
  require(query.state() != TraversalState::kStackOverflow || scene.stack_bound + 3 > stack,
          "the stated stack overflows");
  return hit;
}

/// By the file's spheres and curves, if it has any.
template <bool kAny> Hit hit_with_shapes(const SceneView& scene, const Ray& ray) {
  return dispatch_layout(scene.layout, [&](auto layout) -> Hit {
    using P = WithLayout<decltype(layout)>;
    using Query = std::conditional_t<kAny, AnyHit<P, NoFilter, SceneShapes>, ClosestHit<P, NoFilter, SceneShapes>>;
    PrivateStack<>::Memory stack;
    return hit_within(Query(scene, ray, stack, {}, SceneShapes(scene)), scene, kFlatStack);
  });
}

/// For scenes of instances, at any time, with the shapes that the objects have.
template <bool kAny> PathHit<kLevels> hit_of_instances(const SceneView& scene, const Ray& ray) {
  return dispatch_layout(scene.layout, [&](auto layout) -> PathHit<kLevels> {
    struct Flat : WithLayout<decltype(layout)> {
      using Stack = PrivateStack<kStack>;
    };
    using P = Moving<Instanced<Flat, kLevels>>;
    using Query = std::conditional_t<kAny, AnyHit<P, NoFilter, SceneShapes>, ClosestHit<P, NoFilter, SceneShapes>>;
    typename P::Stack::Memory stack;
    return hit_within(Query(scene, ray, stack, {}, SceneShapes(scene)), scene, kStack);
  });
}

void check_path(const BufferView& view, const Ray& ray, const PathHit<kLevels>& hit) {
  if (!hit.found()) return;
  require(hit.path.depth >= 1 && hit.path.depth <= kLevels, "a path of another length");
  require(hit.path.instance[0] < view.instances.size(), "hit names no instance");
  require((view.instances[hit.path.instance[0]].mask & ray.mask) != 0, "hit of a masked instance");
  require(hit.t >= ray.tmin && hit.t >= 0.0f && hit.t <= ray.tmax && std::isfinite(hit.t),
          "hit outside the ray's interval");
}

void trace_instances(const BufferView& view, const SceneView& scene, fuzz::RaySource& rays) {
  for (int i = 0; i < 16; ++i) {
    const Ray ray = rays.next();
    const auto closest = hit_of_instances<false>(scene, ray), any = hit_of_instances<true>(scene, ray);
    check_path(view, ray, closest);
    check_path(view, ray, any);
    if (scene.levels > kLevels) continue;
    require(closest.found() == any.found(), "closest and any hit of instances disagree");
  }
}

void trace_flat(const BufferView& view, const SceneView& scene, fuzz::RaySource& rays) {
  for (int i = 0; i < 32; ++i) {
    const Ray ray = rays.next();
    const Hit closest = closest_hit(scene, ray), any = any_hit(scene, ray);
    check_hit(view, ray, closest);
    check_hit(view, ray, any);
    const Hit shape = hit_with_shapes<false>(scene, ray), any_shape = hit_with_shapes<true>(scene, ray);
    check_hit(view, ray, shape);
    check_hit(view, ray, any_shape);
    require(shape.found() == any_shape.found(), "closest and any hit of shapes disagree");
    // Until its first hit a closest-hit query makes the same tests as an any-hit query.
    require(closest.found() == any.found(), "closest and any hit disagree");
    require(closest.failed() == any.failed(), "only one query refuses the scene");
  }
}

void trace(const BufferView& view, std::uint64_t seed) {
  const SceneView scene = make_scene_view(view);
  fuzz::RaySource rays(scene.bounds, seed);
  view.has_instances() ? trace_instances(view, scene, rays) : trace_flat(view, scene, rays);
}

/// Printed at the end.
struct Counts {
  std::uint64_t inputs = 0, traced = 0, with_instances = 0, structured = 0;

  ~Counts() {
    std::fprintf(stderr,
                 "fuzz_bvh: %llu inputs, of them %llu mutants by structure; %llu refused, %llu traced, of these %llu "
                 "with instances\n",
                 as_number(inputs), as_number(structured), as_number(inputs - traced), as_number(traced),
                 as_number(with_instances));
  }

 private:
  static unsigned long long as_number(std::uint64_t count) { return count; }
};

Counts counts;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ++counts.inputs;
  test::TestFile file(std::as_bytes(std::span(data, size)));
  // The checksum field is the fuzzer's switch: it gets past the checksum unless its last byte is 0.
  constexpr std::size_t kSwitch = offsetof(FileHeader, checksum) + 7;
  if (size >= sizeof(FileHeader) && data[kSwitch] != 0) file.seal();
  const auto valid = validate(file.bytes());
  if (!valid) {
    require(valid.error().offset <= size, "the report names an offset behind the file");
    return 0;
  }
  const auto view = open_buffer(file.bytes());
  require(view.has_value(), "validate() accepts what open_buffer() refuses");
  ++counts.traced;
  if (view->has_instances()) ++counts.with_instances;
  trace(*view, view->header->checksum);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  fuzz::Random random(seed);
  if (random.below(16) == 0) return LLVMFuzzerMutate(data, size, max_size);
  test::TestFile file(std::as_bytes(std::span(data, size)));
  if (!fuzz::mutate(file, random)) return LLVMFuzzerMutate(data, size, max_size);
  ++counts.structured;
  std::memcpy(data, file.data(), size);
  return size;
}
