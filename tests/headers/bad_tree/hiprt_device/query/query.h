#pragma once
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/scene_view.h>
