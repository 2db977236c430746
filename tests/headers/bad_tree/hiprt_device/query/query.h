#pragma once
#include <hiprt/hiprt_vec.h>  // expect
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/scene_view.h>
