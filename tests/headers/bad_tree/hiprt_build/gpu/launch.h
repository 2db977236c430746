#pragma once
#include <embree3/rtcore.h>  // expect
#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/pair/pair.h>  // expect
#include <hiprt_device/ray.h>       // expect
#include <hiprt_device/scene_view.h>
#include <tools/cli/options.h>  // expect
