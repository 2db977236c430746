#pragma once
#include <hiprt_build/build.h>
#include <hiprt_device/ray.h>
#include <glm/vec3.hpp>    // expect
#include "no_such_file.h"  // expect
