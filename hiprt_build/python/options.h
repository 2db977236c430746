#pragma once
/// The words and numbers of a build, from Python.

#include <hiprt_build/build.h>

#include <nanobind/nanobind.h>

namespace hiprt::python {

/// Options of a build. A key that is absent, or None, keeps its default. The keys are those of hiprt.build(): quality,
/// builder, layout, threads, and the members of BuildOptions with their names.
/// @param defaults for absent keys, if neither quality nor builder is there.
build::BuildOptions options_from(const nanobind::dict& options, const build::BuildOptions& defaults);

}  // namespace hiprt::python
