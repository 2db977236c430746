#pragma once
#include <hiprt_build/build.h>  // expect
#include <hiprt_build/error.h>
#include <hiprt_build/pair/pair.h>  // expect
#include <hiprt_device/scene_view.h>
