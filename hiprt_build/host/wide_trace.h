#pragma once
/// The tracers over WideNodes, one per instruction set. Internal.

#include <hiprt_device/host_scene.h>

namespace hiprt::format_detail {

// The X-macro list of the instruction sets, worst first, is defined for the sources of this folder that need it.
#ifdef HIPRT_WIDE_ISA_LIST
#define HIPRT_ISA(name) const HostTracer& wide_tracer_##name();
HIPRT_WIDE_ISA_LIST
#undef HIPRT_ISA
#endif

}  // namespace hiprt::format_detail
