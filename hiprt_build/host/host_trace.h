#pragma once
/// The tracers over HostNodes, one per instruction set. Internal.

#include <hiprt_device/host_scene.h>

namespace hiprt::format_detail {

// The X-macro list of the instruction sets, worst first, is defined for the sources of this folder that need it.
#ifdef HIPRT_HOST_ISA_LIST
#define HIPRT_ISA(name) const HostTracer& host_tracer_##name();
HIPRT_HOST_ISA_LIST
#undef HIPRT_ISA
#endif

}  // namespace hiprt::format_detail
