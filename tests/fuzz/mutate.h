#pragma once
/// Changes of BVH files that keep most rules, so that the fuzzer spends its time behind the first checks.

#include "mutate_instances.h"
#include "refit.h"

#include <hiprt_build/format/validate.h>

#include <cstring>

namespace hiprt::fuzz {

/// Sets one 32-bit word of a section to another word of it, to an edge value, or to its neighbour.
inline void change_word(test::TestFile& file, const SectionEntry& section, Random& random) {
  const std::uint64_t words = section.count * section.stride / 4;
  if (words == 0) return;
  const std::uint64_t at = section.offset + 4 * random.below(words);
  const auto old = file.get<std::uint32_t>(at);
  constexpr std::uint32_t kEdges[] = {0u,          1u,          0xffffffffu, 0x7f800000u,
                                      0xff800000u, 0x7fc00000u, 0x80000000u, 0x0fffffffu};
  switch (random.below(6)) {
    case 0:
      file.put(at, kEdges[random.below(std::size(kEdges))]);
      break;
    case 1:
      file.put(at, old + 1);
      break;
    case 2:
      file.put(at, old - 1);
      break;
    case 3:
      file.put(at, old ^ std::uint32_t{1} << random.below(32));
      break;
    case 4:
      file.put(at, file.get<std::uint32_t>(section.offset + 4 * random.below(words)));
      break;
    default:
      file.put(at, static_cast<std::uint32_t>(old + 8 * random.below(64)));
      break;
  }
}

/// One of the file's sections that are not empty, each as often as any other.
inline SectionEntry any_section(const BufferView& view, Random& random) {
  const SectionEntry* const all[] = {&view.nodes,
                                     &view.leaves,
                                     &view.primitive_map_entry,
                                     &view.geometry_entry,
                                     &view.provenance_entry,
                                     &view.instance_entry,
                                     &view.object_entry,
                                     &view.object_file_entry,
                                     &view.motion_entry,
                                     &view.segment_entry,
                                     &view.shape_entry,
                                     &view.shape_point_entry,
                                     &view.curve_segment_entry,
                                     &view.object_shape_entry};
  SectionEntry chosen{};
  std::uint64_t seen = 0;
  for (const SectionEntry* section : all)
    if (section->count != 0 && random.below(++seen) == 0) chosen = *section;
  return chosen;
}

/// Changes a word, or moves primitives; mostly fits the boxes of the file's own tree.
inline void change_tree(test::TestFile& file, const BufferView& before, Random& random) {
  if (random.below(2) == 0) {
    dispatch_layout(before.layout(),
                    [&](auto layout) { Refit<decltype(layout)>(file, before).move_primitives(random); });
  } else {
    // A fault in the header hides all others, so the header is changed less often than the content.
    const SectionEntry header{0, 0, 0, sizeof(FileHeader), 1};
    change_word(file, random.below(16) == 0 ? header : any_section(before, random), random);
  }
  // The header may have changed: the section table is read again before it is used.
  const auto after = open_buffer(file.bytes());
  if (after && random.below(8) != 0)
    dispatch_layout(after->layout(), [&](auto layout) { Refit<decltype(layout)>(file, *after).fit(); });
}

/// Changes instances and their objects. @param file accepted by validate().
inline void change_instances(test::TestFile& file, const BufferView& view, Random& random) {
  dispatch_layout(view.layout(), [&](auto layout) {
    InstanceMutator<decltype(layout)> mutator(file);
    for (std::uint64_t changes = 1 + random.below(3); changes > 0; --changes) mutator.change(random);
    mutator.fit();
  });
}

/// @return whether @p file had a good enough table of sections to be changed.
inline bool mutate(test::TestFile& file, Random& random) {
  file.seal_if_possible();
  const auto view = open_buffer(file.bytes());
  if (!view) return false;
  const BufferView before = *view;
  if (before.has_instances() && random.below(4) != 0 && validate(file.bytes()))
    change_instances(file, before, random);
  else
    change_tree(file, before, random);
  // The last byte of the checksum field is fuzz_bvh's switch.
  if (file.get<std::uint8_t>(39) == 0 && random.below(16) != 0) file.put<std::uint8_t>(39, 1);
  return true;
}

}  // namespace hiprt::fuzz
