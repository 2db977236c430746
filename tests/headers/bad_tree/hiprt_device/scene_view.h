#pragma once
#include <hiprt_device/math/vec.h>
#include <hiprt_device/ray.h>  // expect
