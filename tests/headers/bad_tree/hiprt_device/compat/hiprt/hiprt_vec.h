#pragma once
#include <hip/hip_runtime.h>      // expect
#include <hiprt/hiprt_missing.h>  // expect
#include <hiprt_build/build.h>    // expect
#include <hiprt_device/scene_view.h>
#include <vector>  // expect
