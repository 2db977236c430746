#pragma once
#include <embree3/rtcore.h>          // expect
#include <hiprt_build/gpu/launch.h>  // expect
#include <hiprt_build/input.h>
#include <hiprt_build/pair/pair.h>  // expect
#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec.h>
#include <hiprt_device/primitives/sphere.h>  // expect
#include <hiprt_device/ray.h>                // expect
