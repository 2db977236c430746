#pragma once
#include <hiprt_device/absent.h>  // expect
#include <glm/vec3.hpp>           // expect
