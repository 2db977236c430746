#include "shaders.h"

#include <any_miss_rmiss.h>
#include <any_trace_comp.h>
#include <any_trace_rgen.h>
#include <closest_miss_rmiss.h>
#include <closest_trace_comp.h>
#include <closest_trace_rgen.h>
#include <hit_rchit.h>

namespace hiprt::bench::vulkan {

Shaders shaders(bool any_hit) {
  if (any_hit) return {any_trace_rgen, any_miss_rmiss, {}, any_trace_comp};
  return {closest_trace_rgen, closest_miss_rmiss, hit_rchit, closest_trace_comp};
}

}  // namespace hiprt::bench::vulkan
