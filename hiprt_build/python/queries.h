#pragma once
/// Rays, points and boxes in bulk for Python.

#include <hiprt_build/python/rays.h>
#include <hiprt_build/python/scene.h>
#include <hiprt_build/python/tracers/job.h>
#include <hiprt_build/python/watch.h>

#include <nanobind/nanobind.h>

#include <cstddef>
#include <functional>
#include <string>

namespace hiprt::python {

/// Rays of one task: few enough to lie on a thread's stack, and to end soon after Ctrl-C.
inline constexpr std::size_t kBlock = 1024;

/// "watertight", "reference", "fast" or "double".
Precision precision_of(const std::string& word);

/// Refuses scenes that trace() does not cover.
void check_traceable(const SceneView& scene);
/// The same for points and boxes. They cannot find custom primitives.
void check_findable(const SceneView& scene);
/// Refuses a job that a tracer did not do.
void check_done(bool done);

/// Calls body(first, count) for blocks of rays on several threads, until the watch is stopped.
/// @param threads 0: all that the process may use.
void for_blocks(std::size_t rays, unsigned threads, Watch& watch,
                const std::function<void(std::size_t first, std::size_t count)>& body);

/// Adds cast(), occluded() and spawn_origins() to the module.
void add_queries(nanobind::module_& module);
/// Adds count_hits() and list_hits() to the module.
void add_lists(nanobind::module_& module);
/// Adds nearest() and within() to the module.
void add_point_queries(nanobind::module_& module);
/// Adds overlap() and count_overlaps() to the module.
void add_overlaps(nanobind::module_& module);

}  // namespace hiprt::python
