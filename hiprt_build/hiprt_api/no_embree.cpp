// The library has no builders on the CPU. The one function that builders on GPUs ask is here, so that the linker takes
// neither Embree nor oneTBB.

#include <hiprt_build/build.h>

const char* hiprt::build::embree_version() { return ""; }
