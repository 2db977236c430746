#include <embree3/rtcore.h>
#include <hiprt_build/build.h>
#include <tools/options.h>           // expect
#include "../../hiprt_device/ray.h"  // expect
