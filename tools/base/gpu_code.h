#pragma once
/// Which GPU architectures run the code that this build has.

#include <string_view>

namespace hiprt::tools {

/// @return the architectures of this build's GPU code ("gfx90a gfx1030"), or "none" with the reason.
const char* gpu_code_summary();

/// @return whether @p device runs code that was compiled for the architecture @p name. AMD: only if they are equal.
/// NVIDIA: also if the major versions are equal and the minor version of @p name is not larger (sm_86 runs sm_80). A
/// name with a letter at the end (sm_90a) needs exactly that version (sm_90).
constexpr bool runs_code_for(std::string_view device, std::string_view name) {
  if (!name.starts_with("sm_") || name == device) return name == device;
  const std::string_view major = name.substr(0, name.size() - 1);
  if (name.back() < '0' || name.back() > '9') return major == device;
  return name.size() == device.size() && device.starts_with(major) && name.back() <= device.back();
}

/// @return whether @p device runs code for one of @p names, which are separated by spaces.
constexpr bool runs_code_for_one_of(std::string_view device, std::string_view names) {
  for (;;) {
    const std::size_t end = names.find(' ');
    if (runs_code_for(device, names.substr(0, end))) return true;
    if (end == std::string_view::npos) return false;
    names.remove_prefix(end + 1);
  }
}

}  // namespace hiprt::tools
