// Invalid scenes of instances, one fault each: the parts of opened instances, still boxes, the geometry table, and
// bytes between objects.

#include "bad_files.h"
#include "good_parts.h"

#include <hiprt_build/format/view.h>

namespace hiprt::test {

namespace {

constexpr std::uint64_t kEntry = offsetof(CustomLeaf, info) + 4;

/// The report must name the entry of the scene's first leaf.
BadCase bad_parts(const char* what, std::vector<NodeRef> (*refs)(const TestScene&), Applies applies = any_layout) {
  return {FormatError::kBadInstance, what,
          [=](NodeLayout layout) {
            const TestScene object = row_scene(layout);
            TestFile file = opened_file(object, refs(object));
            const std::uint64_t at = open_buffer(file.bytes())->leaves.offset + kEntry;
            return BadFile{std::move(file), at};
          },
          applies};
}

std::vector<BadCase> part_cases() {
  const auto header_as_node = [](const TestScene& s) {
    return std::vector<NodeRef>{TestScene::make_reference(0, s.box_type())};
  };
  const auto end_as_node = [](const TestScene& s) {
    return std::vector<NodeRef>{TestScene::make_reference(s.node_at(2), s.box_type())};
  };
  const auto half_a_node = [](const TestScene& s) {
    return std::vector<NodeRef>{TestScene::make_reference(s.node_at(0) + 64, s.box_type())};
  };
  return {
      bad_parts("an extra part alone",
                [](const TestScene& s) {
                  return std::vector{root_of(s), node_of(s, 1)};
                }),
      bad_parts("a part twice",
                [](const TestScene& s) {
                  return std::vector{root_of(s), root_of(s)};
                }),
      bad_parts("a part is missing", [](const TestScene& s) { return std::vector{node_of(s, 1)}; }),
      bad_parts("a later leaf of a run",
                [](const TestScene& s) {
                  return std::vector{run_of(s, 0), run_of(s, 1), node_of(s, 1)};
                }),
      bad_parts("the header as a node", header_as_node),
      bad_parts("the end of the nodes as a node", end_as_node),
      bad_parts("half of a node", half_a_node, float_planes),
      {FormatError::kBadInstance, "a part one level too deep",
       [](NodeLayout layout) {
         const TestScene object = chain_scene(layout, kMostOpenedLevels + 2);
         TestFile file = opened_file(object, chain_parts(object, kMostOpenedLevels + 1));
         const std::uint64_t at = open_buffer(file.bytes())->leaves.offset + kEntry;
         return BadFile{std::move(file), at};
       }},
  };
}

/// Two instances of row_scene(), and @p fault in their file. @p fault returns the byte that the report must name.
BadCase still_fault(FormatError error, const char* what,
                    const std::function<std::uint64_t(TestFile&, const BufferView&)>& fault) {
  return {error, what, [=](NodeLayout layout) {
            TestFile file = instances_of(row_scene(layout), 2);
            const BufferView view = *open_buffer(file.bytes());
            const std::uint64_t at = fault(file, view);
            file.seal();
            return BadFile{std::move(file), at};
          }};
}

std::vector<BadCase> still_cases() {
  using E = FormatError;
  // So much below what is needed is more than the slack for other compilers, 2^-20.
  constexpr float kLess = 1 - 0x1p-19f;
  return {
      still_fault(E::kBoxNotContained, "a still instance leaves its leaf's box, but not the node's",
                  [](TestFile& file, const BufferView& view) {
                    const std::uint64_t at = view.leaves.offset + 12;
                    file.put(at, file.get<float>(at) - 0x1p-10f);
                    return at;
                  }),
      still_fault(E::kGeometryCount, "a second geometry, without instances",
                  [](TestFile& file, const BufferView& view) {
                    for (std::uint64_t i = 0; i < view.header->section_count; ++i)
                      if (file.get<std::uint64_t>(TestScene::entry_at(i) + 8) == view.geometry_entry.offset)
                        file.put(TestScene::entry_at(i) + 16, std::uint64_t{2});
                    file.put(52, 2u);
                    file.put(view.geometry_entry.offset + sizeof(GeometryRecord),
                             GeometryRecord{2, 0, 0, 0xffffffffu, custom_geometry_flags(0)});
                    return view.geometry_entry.offset;
                  }),
      still_fault(E::kGeometryCount, "custom primitives of another type",
                  [](TestFile& file, const BufferView& view) {
                    file.put(view.geometry_entry.offset + offsetof(GeometryRecord, flags), custom_geometry_flags(1));
                    return view.geometry_entry.offset;
                  }),
      still_fault(E::kGeometryCount, "a mask of the geometry",
                  [](TestFile& file, const BufferView& view) {
                    file.put(view.geometry_entry.offset + offsetof(GeometryRecord, mask), 1u);
                    return view.geometry_entry.offset;
                  }),
      still_fault(E::kPrimitiveCount, "fewer records than primitives",
                  [](TestFile& file, const BufferView& view) {
                    for (std::uint64_t i = 0; i < view.header->section_count; ++i)
                      if (file.get<std::uint64_t>(TestScene::entry_at(i) + 8) == view.instance_entry.offset)
                        file.put(TestScene::entry_at(i) + 16, std::uint64_t{1});
                    file.put(view.instance_entry.offset + sizeof(InstanceRecord), InstanceRecord{});
                    return view.geometry_entry.offset + 8;
                  }),
      still_fault(E::kBadInstance, "a condition beyond 2^40",
                  [](TestFile& file, const BufferView& view) {
                    file.put(view.instance_entry.offset, 0x1p-42f);
                    return view.instance_entry.offset;
                  }),
      still_fault(E::kBadTransformBound, "a condition just below what is needed",
                  [](TestFile& file, const BufferView& view) {
                    file.put(offsetof(FileHeader, condition), kLess * view.header->condition);
                    return offsetof(FileHeader, condition);
                  }),
      still_fault(E::kBadTransformBound, "a reach just below what is needed",
                  [](TestFile& file, const BufferView& view) {
                    file.put(offsetof(FileHeader, reach), kLess * view.header->reach);
                    return offsetof(FileHeader, reach);
                  }),
      still_fault(E::kBadChildFlags, "a child of instances that is called mixed",
                  [](TestFile& file, const BufferView& view) {
                    TestScene scene;
                    scene.layout = view.layout();
                    const std::uint64_t at = view.nodes.offset + (scene.flags_at(0, 0) - scene.node_at(0));
                    file.put(at, std::uint8_t{1});
                    return at;
                  }),
  };
}

}  // namespace

std::vector<BadCase> part_and_still_cases() {
  std::vector<BadCase> all = part_cases();
  for (BadCase& bad : still_cases()) {
    if (bad.error == FormatError::kBadChildFlags) bad.applies = not_half;
    all.push_back(std::move(bad));
  }
  all.push_back({FormatError::kBadReservedField, "a byte between two objects", [](NodeLayout layout) {
                   const TestFile first = row_scene(layout).write(), second = root_leaf_scene(layout).write();
                   TestFile file = scene_of({first.bytes(), second.bytes()}, {{.object = 0}, {.object = 1}});
                   const BufferView view = *open_buffer(file.bytes());
                   const std::uint64_t at = view.objects[0].offset + view.objects[0].size;
                   if (at == view.objects[1].offset) throw std::logic_error("no byte between the objects");
                   file.put(at, std::uint8_t{1});
                   file.seal();
                   return BadFile{std::move(file), at};
                 }});
  all.push_back({FormatError::kBadObject, "an object of another layout", [](NodeLayout layout) {
                   const NodeLayout other = layout == NodeLayout::kFloat ? NodeLayout::kPlanes : NodeLayout::kFloat;
                   TestFile file = instances_of(root_leaf_scene(layout), 1);
                   const TestFile object = root_leaf_scene(other).write();
                   const std::uint64_t at = open_buffer(file.bytes())->objects[0].offset;
                   if (open_buffer(file.bytes())->objects[0].size != object.size()) throw std::logic_error("sizes");
                   std::memcpy(file.data() + at, object.data(), object.size());
                   file.seal();
                   return BadFile{std::move(file), at};
                 }});
  all.push_back({FormatError::kBadObject, "an object that has objects", [](NodeLayout layout) {
                   // It replaces a larger object.
                   const TestFile inner = instances_of(root_leaf_scene(layout), 1);
                   TestFile file = instances_of(chain_scene(layout, 40), 1);
                   const BufferView view = *open_buffer(file.bytes());
                   const std::uint64_t at = view.objects[0].offset, size = view.objects[0].size;
                   if (inner.size() > size) throw std::logic_error("the inner scene is too large");
                   std::memset(file.data() + at, 0, size);
                   std::memcpy(file.data() + at, inner.data(), inner.size());
                   file.put(view.object_entry.offset + offsetof(ObjectRecord, size), std::uint64_t{inner.size()});
                   file.seal();
                   return BadFile{std::move(file), at};
                 }});
  return all;
}

}  // namespace hiprt::test
