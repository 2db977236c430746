#pragma once
/// Small .scene files for tests.

#include "temp_folder.h"

#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

class SceneFile {
 public:
  /// The triangle (0, 0), (1, 0), (0, 1) at z.
  SceneFile& triangle(float z) {
    ++objects_;
    append(body_, 0u, 3u, 1u, 0.f, 0.f, z, 1.f, 0.f, z, 0.f, 1.f, z, 0u, 1u, 2u);
    return *this;
  }
  /// Objects, each moved along x.
  SceneFile& group(const std::vector<std::pair<unsigned, float>>& children) {
    ++objects_;
    append(body_, 1u, static_cast<unsigned>(children.size()));
    for (const auto& [object, x] : children)
      append(body_, object, 1.f, 0.f, 0.f, x, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f);
    return *this;
  }
  std::string bytes() const {
    std::string all = "SCN1";
    append(all, objects_);
    return all + body_;
  }

 private:
  unsigned objects_ = 0;
  std::string body_;
};

}  // namespace hiprt::test
