#pragma once
#include <hiprt_build/build.h>  // expect
#include <hiprt_device/math/vec.h>
#include <tbb/task.h>    // expect
#include HIPRT_RAY_BASE  // expect
