#pragma once
/// Small .hair files for tests, written byte by byte.

#include <tests/tools/temp_folder.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::test {

/// The content of a .hair file. The bits of `arrays` say which arrays are written.
struct HairFile {
  std::string magic = "HAIR";
  std::uint32_t strands = 2, points = 5, arrays = 1 | 2 | 4, default_segments = 0;
  float default_thickness = 0;
  std::vector<std::uint16_t> segments{2, 1};
  std::vector<float> positions{0, 0, 0, 1, 0, 0, 2, 0.5f, 0, 0, 3, 0, 0, 3, 1};
  std::vector<float> thickness{0.5f, 0.25f, 0, 1, 1};
  std::string more{};  ///< Behind these: transparency, colours.

  std::string bytes() const {
    std::string all = magic;
    append(all, strands, points, arrays, default_segments, default_thickness, 0.f, 1.f, 1.f, 1.f);
    std::string text = "made by a test";
    text.resize(88);
    all += text;
    if ((arrays & 1u) != 0)
      for (const std::uint16_t count : segments) append(all, count);
    if ((arrays & 2u) != 0)
      for (const float x : positions) append(all, x);
    if ((arrays & 4u) != 0)
      for (const float x : thickness) append(all, x);
    return all + more;
  }
};

}  // namespace hiprt::test
