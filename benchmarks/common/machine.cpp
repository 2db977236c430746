#include "machine.h"

#include <algorithm>
#include <fstream>

namespace hiprt::bench {

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string text; std::getline(file, text);)
    if (text.starts_with("model name")) return text.substr(std::min(text.size(), text.find(':') + 2));
  return "unknown";
}

}  // namespace hiprt::bench
