#pragma once
#include <hiprt_device/format/node.h>
#include <hiprt_device/ray.h>  // expect
#include <glm/vec3.hpp>
#include "motion.h"
