#pragma once
/// The tracers that are compared: compiled policy sets, Embree, and Vulkan.

#include "work.h"

#include <string>
#include <vector>

namespace hiprt::bench {

struct Subject {
  std::string name;
  std::string triangle, boxes, layout, compiler;  ///< Empty for Embree and Vulkan.
  std::size_t set = 0;                            ///< Index into kPolicySets.
  Compiler settings = Compiler::kUsual;
  bool ours = true;     ///< Has error bounds, and boxes that can be widened.
  bool robust = false;  ///< Embree's RTC_SCENE_FLAG_ROBUST.
  std::string vulkan;   ///< Of vulkan_modes(); empty for other tracers.
};

/// The policy sets, in the order of the tables.
std::vector<Subject> policy_subjects();
/// Embree without and with the robust flag.
std::vector<Subject> embree_subjects();
/// @param modes of Vulkan (vulkan_modes()).
std::vector<Subject> vulkan_subjects(const std::vector<std::string>& modes);

}  // namespace hiprt::bench
