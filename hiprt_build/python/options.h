#pragma once
/// The words and numbers of a build, from Python.

#include <hiprt_build/build.h>

#include <nanobind/nanobind.h>

namespace hiprt::python {

/// Options of a build. Keys that are absent, or None, keep their defaults: quality, builder, layout, threads,
/// split_budget, presplit_budget, reinsertion_rounds, max_leaf_triangles, pair_triangles, ploc_radius.
/// @param defaults for absent keys, if neither quality nor builder is there.
build::BuildOptions options_from(const nanobind::dict& options, const build::BuildOptions& defaults);

}  // namespace hiprt::python
