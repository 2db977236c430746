#pragma once
/// Builds and refits for Python.

#include <nanobind/nanobind.h>

namespace hiprt::python {

/// Adds build(), build_instances() and refit() to the module.
void add_build(nanobind::module_& module);

}  // namespace hiprt::python
