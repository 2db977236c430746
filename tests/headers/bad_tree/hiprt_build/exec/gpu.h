#pragma once
#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_device/query/query.h>  // expect
#include <hiprt_device/scene_view.h>
