// The headers for hosts need C++17 only. hiprt_libpath.h defines variables: it is in this file alone.

#include <hiprt/hiprt_libpath.h>
#include <hiprt/hiprt_math.h>
#include <hiprt/hiprt_types.h>

static_assert(__cplusplus == 201703L);
