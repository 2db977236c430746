#pragma once
/// Queries of tensors in the memory of GPUs.

#include <nanobind/nanobind.h>

namespace hiprt::python::gpu {

/// Adds the classes and functions whose names begin with Gpu and gpu_ to the module. hiprt/_gpu.py calls them.
void add_gpu(nanobind::module_& module);

}  // namespace hiprt::python::gpu
