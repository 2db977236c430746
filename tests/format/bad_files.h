#pragma once
/// Small invalid files with exactly one fault: at least one for every FormatError.

#include "test_scene.h"

#include <hiprt_build/format/error.h>

#include <functional>
#include <vector>

namespace hiprt::test {

/// A file with one thing wrong.
struct BadFile {
  TestFile file;
  std::uint64_t offset;  ///< That the report must name.
};

/// Whether a layout can have the fault.
using Applies = bool (*)(NodeLayout);
inline bool any_layout(NodeLayout) { return true; }
inline bool float_planes(NodeLayout layout) { return layout == NodeLayout::kFloat || layout == NodeLayout::kPlanes; }
inline bool only_half(NodeLayout layout) { return layout == NodeLayout::kHalf; }
inline bool only_quantized(NodeLayout layout) { return layout == NodeLayout::kQuantized; }
inline bool not_half(NodeLayout layout) { return !only_half(layout); }

struct BadCase {
  FormatError error;
  const char* what;
  std::function<BadFile(NodeLayout)> make;
  Applies applies = any_layout;
};
inline constexpr NodeLayout kAllLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf,
                                             NodeLayout::kQuantized};

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
/// A node reference to byte_of(scene) instead.
template <class OffsetOf, class ByteOf>
std::function<BadFile(NodeLayout)> row_reference(OffsetOf offset_of, ByteOf byte_of, std::uint32_t type) {
  return [=](NodeLayout layout) {
    const TestScene scene = row_scene(layout);
    return patched(scene, offset_of(scene), TestScene::make_reference(byte_of(scene), type));
  };
}
/// A scene changed by @p change; the report must name offset_of(scene).
inline std::function<BadFile(NodeLayout)> changed(TestScene (*make)(NodeLayout),
                                                  const std::function<void(TestScene&)>& change,
                                                  const std::function<std::uint64_t(const TestScene&)>& offset_of) {
  return [=](NodeLayout layout) {
    TestScene scene = make(layout);
    change(scene);
    return BadFile{scene.write(), offset_of(scene)};
  };
}
template <class T> std::function<BadFile(NodeLayout)> row_header_with(std::uint64_t offset, T value) {
  return row_with([=](const TestScene&) { return offset; }, value);
}

/// Header, section table, padding, provenance, geometry table and primitive map.
std::vector<BadCase> container_cases();
/// References, boxes, leaves and split primitives.
std::vector<BadCase> content_cases();
/// The encodings of layouts half and quantized, and custom leaves.
std::vector<BadCase> encoding_cases();
std::vector<BadCase> custom_cases();
/// Instances and objects.
std::vector<BadCase> instance_cases();
std::vector<BadCase> motion_cases();
/// Parts of instances, boxes and records, each with one fault that no other check reports.
std::vector<BadCase> part_and_still_cases();
std::vector<BadCase> one_motion_fault_cases();
/// Spheres and curves.
std::vector<BadCase> shape_cases();

}  // namespace hiprt::test
