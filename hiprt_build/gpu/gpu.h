#pragma once
/// The small GPU runtime of hiprt: memory, scenes, launches, events. Headers only, for what hipcc or nvcc compile and
/// for host code that finds <hip/hip_runtime.h>. Every operation goes to the caller's stream on the caller's current
/// device, which is the same afterwards; nothing is kept between calls. Errors are values. The only exception that
/// there can be is std::bad_alloc of host memory for a message.

#include <hiprt_build/gpu/allocator.h>
#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/gpu/error.h>
#include <hiprt_build/gpu/event.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/gpu/replicate.h>
#include <hiprt_build/gpu/scene.h>
#include <hiprt_build/gpu/tune.h>
