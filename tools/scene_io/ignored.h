#pragma once
/// What a reader leaves out of a file, by kind, for one warning per file.

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::tools {

class Ignored {
 public:
  /// @param kind in the plural: "lines".
  void add(const std::string& kind, std::uint64_t count = 1) {
    if (count == 0) return;
    for (auto& [name, sum] : kinds_)
      if (name == kind) {
        sum += count;
        return;
      }
    kinds_.emplace_back(kind, count);
  }

  /// Appends "ignored: lines (12), cameras (1)", in the order in which they were added, unless there is nothing.
  void warn(std::vector<std::string>& warnings) const {
    constexpr std::size_t kMostKinds = 16;
    std::string text;
    for (std::size_t i = 0; i < kinds_.size() && i < kMostKinds; ++i)
      text += (i == 0 ? "" : ", ") + kinds_[i].first + " (" + std::to_string(kinds_[i].second) + ")";
    if (kinds_.size() > kMostKinds) text += ", and " + std::to_string(kinds_.size() - kMostKinds) + " more kinds";
    if (!text.empty()) warnings.push_back("ignored: " + text);
  }

 private:
  std::vector<std::pair<std::string, std::uint64_t>> kinds_;
};

}  // namespace hiprt::tools
