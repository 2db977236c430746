#include <embree3/rtcore.h>
#include <hip/hip_runtime.h>  // expect
#include <hiprt_build/build.h>
#include <hiprt_build/gpu/launch.h>    // expect
#include <hiprt_build/python/scene.h>  // expect
#include <nanobind/nanobind.h>         // expect
#include <tools/cli/options.h>         // expect
#include "../../hiprt_device/ray.h"    // expect
