#pragma once
/// Small files with exactly one thing wrong: at least one for every FormatError.

#include "test_scene.h"

#include <hiprt_device/format/error.h>

#include <functional>
#include <vector>

namespace hiprt::test {

/// A file with one thing wrong.
struct BadFile {
  TestFile file;
  std::uint64_t offset;  ///< That the report must name.
};

struct BadCase {
  FormatError error;
  const char* what;
  std::function<BadFile(NodeLayout)> make;
};

/// row_scene() with value at offset_of(scene), checksum right.
template <class T> BadFile patched(const TestScene& scene, std::uint64_t offset, T value) {
  BadFile bad{scene.write(), offset};
  bad.file.put(offset, value);
  if (offset != 24 && offset != 32) bad.file.seal();
  return bad;
}

template <class T, class OffsetOf> std::function<BadFile(NodeLayout)> row_with(OffsetOf offset_of, T value) {
  return [=](NodeLayout layout) {
    const TestScene scene = row_scene(layout);
    return patched(scene, offset_of(scene), value);
  };
}
template <class T> std::function<BadFile(NodeLayout)> row_header_with(std::uint64_t offset, T value) {
  return row_with([=](const TestScene&) { return offset; }, value);
}

/// Header, section table, padding, provenance, geometry table and primitive map.
std::vector<BadCase> container_cases();
/// References, boxes, leaves and split primitives.
std::vector<BadCase> content_cases();

}  // namespace hiprt::test
