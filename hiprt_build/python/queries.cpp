#include <hiprt_build/python/queries.h>

#include <hiprt_build/exec/threads.h>
#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/tracers/tracers.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/host_scene.h>
#include <hiprt_device/query/spawn.h>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <span>
#include <type_traits>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

/// Where the hits of a cast go, one array per member.
template <class Real> struct HitArrays {
  Real *t, *u, *v;
  std::uint32_t *geometry, *primitive;
  Real* normal;
  float* error;
  std::uint32_t* paths;  ///< nullptr in scenes without levels.

  HitArrays(const nb::tuple& arrays, std::size_t rays, std::size_t levels) {
    const auto array = [&](std::size_t i) { return nb::cast<OutputArray>(arrays[i]); };
    t = data_of<Real>(array(0), "t", rays);
    u = data_of<Real>(array(1), "u", rays);
    v = data_of<Real>(array(2), "v", rays);
    geometry = data_of<std::uint32_t>(array(3), "geometry", rays);
    primitive = data_of<std::uint32_t>(array(4), "primitive", rays);
    normal = data_of<Real>(array(5), "normal", 3 * rays);
    error = data_of<float>(array(6), "error", rays);
    paths = levels == 0 ? nullptr : data_of<std::uint32_t>(array(7), "instances", levels * rays);
  }

  void scatter(std::size_t first, std::size_t count, const BasicHit<Real>* hits) const {
    for (std::size_t i = 0; i < count; ++i) {
      const BasicHit<Real>& hit = hits[i];
      const std::size_t to = first + i;
      t[to] = hit.t;
      u[to] = hit.u;
      v[to] = hit.v;
      geometry[to] = hit.geometry;
      primitive[to] = hit.primitive;
      for (int axis = 0; axis < 3; ++axis) normal[3 * to + static_cast<std::size_t>(axis)] = hit.normal[axis];
      error[to] = hit.error;
    }
  }
};

/// Traces a block of rays, or as many as there are before the watch is stopped.
template <class Real>
void trace_block(const SceneView& scene, Query query, Precision precision, std::span<const BasicRay<Real>> rays,
                 std::span<BasicHit<Real>> hits, std::uint32_t* paths, const Watch& watch) {
  // The library's own tracer finds the same hits faster.
  if constexpr (std::is_same_v<Real, float>)
    if (precision == Precision::kWatertight && current_host_scene(scene) != nullptr)
      return value_of(query == Query::kClosest ? closest_hits(scene, rays, hits) : any_hits(scene, rays, hits));
  // Where hundreds of triangles overlap, a ray may take a tenth of a millisecond.
  constexpr std::size_t kPiece = 128;
  for (std::size_t first = 0; first < rays.size() && !watch.stopped(); first += kPiece) {
    std::uint32_t* const path = paths == nullptr ? nullptr : paths + first * scene.levels;
    const std::size_t count = std::min(kPiece, rays.size() - first);
    trace({&scene, query, precision, rays.data() + first, hits.data() + first, path, count, {}});
  }
}

/// Traces all rays. @param take receives the number of the first ray of a block, the number of rays, and their hits.
template <class Real, class Take>
void trace_all(const SceneView& scene, const Rays& rays, Query query, Precision precision, unsigned threads,
               Watch& watch, std::uint32_t* paths, const Take& take) {
  for_blocks(rays.size(), threads, watch, [&](std::size_t first, std::size_t count) {
    BasicRay<Real> block[kBlock];
    BasicHit<Real> hits[kBlock];
    rays.gather(first, count, block);
    trace_block<Real>(scene, query, precision, std::span<const BasicRay<Real>>(block, count),
                      std::span<BasicHit<Real>>(hits, count), paths == nullptr ? nullptr : paths + first * scene.levels,
                      watch);
    take(first, count, hits);
  });
}

template <class Real>
void cast_as(const SceneData& data, const Rays& rays, Precision precision, unsigned threads, const nb::object& progress,
             const nb::tuple& arrays) {
  const HitArrays<Real> to(arrays, rays.size(), data.view().header->levels);
  Watch watch(rays.size());
  run_watched(progress, watch, rays.size() <= kBlock, [&] {
    const SceneView scene = data.view_for(rays.size(), watch);
    check_traceable(scene);
    trace_all<Real>(
        scene, rays, Query::kClosest, precision, threads, watch, to.paths,
        [&](std::size_t first, std::size_t count, const BasicHit<Real>* hits) { to.scatter(first, count, hits); });
  });
}

void cast(const Scene& scene, const Rays& rays, const std::string& word, unsigned threads, const nb::object& progress,
          const nb::tuple& arrays) {
  const Precision precision = precision_of(word);
  const auto data = scene.data();
  precision == Precision::kDouble ? cast_as<double>(*data, rays, precision, threads, progress, arrays)
                                  : cast_as<float>(*data, rays, precision, threads, progress, arrays);
}

template <class Real>
void find_occluded(const SceneData& data, const Rays& rays, Precision precision, unsigned threads,
                   const nb::object& progress, bool* to) {
  Watch watch(rays.size());
  run_watched(progress, watch, rays.size() <= kBlock, [&] {
    const SceneView scene = data.view_for(rays.size(), watch);
    check_traceable(scene);
    trace_all<Real>(scene, rays, Query::kAny, precision, threads, watch, nullptr,
                    [&](std::size_t first, std::size_t count, const BasicHit<Real>* hits) {
                      for (std::size_t i = 0; i < count; ++i) to[first + i] = hits[i].found();
                    });
  });
}

void occluded(const Scene& scene, const Rays& rays, const std::string& word, unsigned threads,
              const nb::object& progress, const OutputArray& result) {
  const Precision precision = precision_of(word);
  const auto data = scene.data();
  bool* const to = data_of<bool>(result, "occluded", rays.size());
  precision == Precision::kDouble ? find_occluded<double>(*data, rays, precision, threads, progress, to)
                                  : find_occluded<float>(*data, rays, precision, threads, progress, to);
}

template <class Real>
void spawn_as(const Rays& rays, const InputArray& t, const InputArray& normal, const InputArray& error,
              const InputArray& directions, const OutputArray& result) {
  Real* const to = data_of<Real>(result, "origins", 3 * rays.size());
  const auto number = [](const InputArray& array, std::size_t i) { return static_cast<const Real*>(array.data())[i]; };
  const auto vector = [&](const InputArray& array, std::size_t i) {
    return BasicVec3<Real>(number(array, 3 * i), number(array, 3 * i + 1), number(array, 3 * i + 2));
  };
  for (std::size_t i = 0; i < rays.size(); ++i) {
    BasicRay<Real> ray;
    rays.gather(i, 1, &ray);
    BasicHit<Real> hit;
    hit.t = number(t, i);
    hit.normal = vector(normal, i);
    hit.error = static_cast<const float*>(error.data())[i];
    const BasicVec3<Real> origin = spawn_origin(ray, hit, vector(directions, i));
    for (int axis = 0; axis < 3; ++axis) to[3 * i + static_cast<std::size_t>(axis)] = origin[axis];
  }
}

/// All arrays without gaps and of the type of @p t.
void spawn_origins(const Rays& rays, const InputArray& t, const InputArray& normal, const InputArray& error,
                   const InputArray& directions, const OutputArray& result) {
  if (t.size() != rays.size() || normal.size() != 3 * t.size() || error.size() != t.size() ||
      directions.size() != 3 * t.size() || normal.dtype() != t.dtype() || directions.dtype() != t.dtype())
    refuse("spawn_origins: the arrays differ in size or type");
  t.dtype() == nb::dtype<double>() ? spawn_as<double>(rays, t, normal, error, directions, result)
                                   : spawn_as<float>(rays, t, normal, error, directions, result);
}

}  // namespace

Precision precision_of(const std::string& word) {
  if (word == "watertight") return Precision::kWatertight;
  if (word == "reference") return Precision::kReference;
  if (word == "fast") return Precision::kFast;
  if (word == "double") return Precision::kDouble;
  refuse("precision: '" + word + "' is none of watertight, reference, fast, double");
}

void check_traceable(const SceneView& scene) {
  if (!is_traceable(scene))
    refuse("the scene cannot be traced from Python: it has more than " + std::to_string(kMostLevels) +
           " levels of instances, a deeper tree than builders make, or custom primitives whose shapes are not in the "
           "file");
}

void check_findable(const SceneView& scene) {
  if (!has_only_triangles(scene))
    refuse(
        "the scene has custom primitives (spheres, curves), and points and boxes find triangles only: build a scene "
        "of its triangles");
  check_traceable(scene);
}

void check_done(bool done) {
  if (!done) refuse("the scene's tree is deeper than its file says: check the file with validate()");
}

void for_blocks(std::size_t rays, unsigned threads, Watch& watch,
                const std::function<void(std::size_t first, std::size_t count)>& body) {
  if (rays <= kBlock) return body(0, rays);
  build::Threads::run(threads, [&] {
    build::Threads::for_each((rays + kBlock - 1) / kBlock, [&](std::size_t block) {
      if (watch.stopped()) return;
      const std::size_t first = block * kBlock, count = std::min(kBlock, rays - first);
      body(first, count);
      watch.add(count);
    });
  });
}

void add_queries(nb::module_& module) {
  module.def("cast", &cast, nb::arg("scene"), nb::arg("rays"), nb::arg("precision"), nb::arg("threads"),
             nb::arg("progress").none(), nb::arg("arrays"));
  module.def("occluded", &occluded, nb::arg("scene"), nb::arg("rays"), nb::arg("precision"), nb::arg("threads"),
             nb::arg("progress").none(), nb::arg("result"));
  module.def("spawn_origins", &spawn_origins, nb::arg("rays"), nb::arg("t"), nb::arg("normal"), nb::arg("error"),
             nb::arg("directions"), nb::arg("result"));
}

}  // namespace hiprt::python
