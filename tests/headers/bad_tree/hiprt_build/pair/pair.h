#pragma once
#include <hiprt_build/input.h>
#include <hiprt_device/math/vec.h>
#include <tbb/parallel_for.h>
