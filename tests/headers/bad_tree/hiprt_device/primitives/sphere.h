#pragma once
#include <hiprt_build/build.h>         // expect
#include <hiprt_device/query/query.h>  // expect
#include <hiprt_device/ray.h>
