#pragma once
/// Programs of HIPRT are often compiled with -ffast-math. The guarantees of this library end there (GUARANTEES.md).
#if defined(__FAST_MATH__) && !defined(HIPRT_ALLOW_FAST_MATH)
#define HIPRT_ALLOW_FAST_MATH
#endif
