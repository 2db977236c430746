#pragma once
/// The same as hiprt_device.h, for programs that compile HIPRT's bodies themselves.
///
/// Such a program defines intersectFunc() and filterFunc(). impl/functions.h declares them.

#include <hiprt/hiprt_device.h>
