/// The extension module hiprt._core. hiprt/__init__.py is the interface; it checks and converts arguments.

#include <hiprt_build/build.h>
#include <hiprt_build/python/build.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/gpu/queries.h>
#include <hiprt_build/python/points.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/rays.h>
#include <hiprt_build/python/scene.h>
#include <hiprt_build/python/tracers/tracers.h>

#include <nanobind/nanobind.h>

NB_MODULE(_core, module) {
  namespace python = hiprt::python;
  module.doc() = "The compiled part of hiprt. Programs use the functions of hiprt, which check their arguments.";
  python::register_errors();
  python::add_rays(module);
  python::add_scene(module);
  python::add_build(module);
  python::add_queries(module);
  python::add_lists(module);
  python::add_points(module);
  python::add_point_queries(module);
  python::add_overlaps(module);
  python::gpu::add_gpu(module);
  module.def("version", &hiprt::build::version, "Version of the library, for example \"0.2.0\".");
  module.def("trace_isa", &python::trace_isa, "Instruction set of the tracers, for example \"x86_64_v3\".");
}
