#pragma once
/// HIPRT's traversals, stacks and transform queries in kernels.
///
/// hiprt_device/docs/HIPRT_PROGRAMS.md says how to compile programs with this header, and what differs.

#define HIPRT_PUBLIC_DEVICE_H

#include <hiprt/impl/allow_fast_math.h>

#include <hiprt/hiprt_math.h>
#include <hiprt/hiprt_types.h>
#include <hiprt/impl/classes.h>
#include <hiprt/impl/queries.h>
#include <hiprt/impl/stacks.h>
