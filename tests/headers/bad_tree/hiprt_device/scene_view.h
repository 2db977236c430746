#pragma once
#include <hiprt_device/ray.h>  // expect
#include <hiprt_device/vec.h>
