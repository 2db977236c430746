#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/utf8.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/validate_instances.h>
#include <hiprt_build/format/validate_primitives.h>
#include <hiprt_build/format/validate_shapes.h>
#include <hiprt_build/format/validate_tree.h>
#include <hiprt_build/format/view.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace hiprt {

using namespace format_detail;

namespace {

Check check_zero(const BufferView& view, std::uint64_t begin, std::uint64_t end) {
  for (std::uint64_t at = begin; at < end; ++at)
    if (view.bytes[at] != std::byte{0})
      return fail(FormatError::kBadReservedField, at, std::to_integer<std::uint64_t>(view.bytes[at]), 0);
  return {};
}

/// Checks that bytes between nodes are zero.
Check check_node_gaps(const BufferView& view) {
  const NodePlaces places = view.node_places();
  for (std::uint64_t i = 0; i < places.gaps(view.node_count()); ++i) {
    const std::uint64_t end = view.nodes.offset + places.offset((i + 1) * kNodesPerBlock);
    if (auto zero = check_zero(view, end - kNodeGranularity, end); !zero) return zero;
  }
  return {};
}

/// Checks that bytes between the sections, and behind the last, are zero.
Check check_padding(const BufferView& view) {
  const std::uint32_t count = view.header->section_count;
  const auto* table = reinterpret_cast<const SectionEntry*>(view.bytes.data() + sizeof(FileHeader));
  std::array<std::pair<std::uint64_t, std::uint64_t>, kMaxSections + 1> used{};
  for (std::uint32_t i = 0; i < count; ++i)
    used[i] = {table[i].offset, table[i].offset + table[i].count * table[i].stride};
  used[count] = {view.bytes.size(), view.bytes.size()};
  std::sort(used.begin(), used.begin() + count);
  std::uint64_t end = sizeof(FileHeader) + count * sizeof(SectionEntry);
  for (std::uint32_t i = 0; i <= count; ++i) {
    if (auto zero = check_zero(view, end, used[i].first); !zero) return zero;
    end = std::max(end, used[i].second);
  }
  return check_node_gaps(view);
}

/// Checks that the bit kMasks matches the geometries.
///
/// kSplitReferences may be set though nothing is split: a builder that splits need not count. The check of leaves
/// finds a missing kSplitReferences, and the check of the tree wrong kTriangles and kCustom.
Check check_features(const BufferView& view) {
  // InstanceCheck checks the bits of instances and their objects.
  if (view.has_instances()) return {};
  const auto has_mask = [](const GeometryRecord& geometry) { return geometry.mask != 0xffffffffu; };
  FeatureMask expected = view.header->features & ~feature_bit(Feature::kMasks);
  if (std::any_of(view.geometries.begin(), view.geometries.end(), has_mask)) expected |= feature_bit(Feature::kMasks);
  if (view.header->features == expected) return {};
  return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), view.header->features, expected);
}

/// A tree of n nodes never needs more than 3 n entries. Larger bounds are refused, because readers allocate by them.
/// @param of_objects the part of the need that belongs to objects.
Check check_stack_bound(const BufferView& view, std::uint32_t need, std::uint32_t of_objects) {
  const std::uint64_t most = view.node_count() * (kBranching - 1) + of_objects, bound = view.header->stack_bound;
  if (bound >= need && bound <= most) return {};
  return fail(FormatError::kStackBound, offsetof(FileHeader, stack_bound), bound, bound < need ? need : most);
}

/// Checks the outside of a JSON object: UTF-8 from '{' to '}', with white space around. JSON parsers check the rest.
Check check_provenance(const BufferView& view) {
  if (view.provenance_entry.kind == 0) return {};
  const std::string_view text = view.provenance;
  const std::uint64_t at = view.provenance_entry.offset;
  constexpr std::string_view kWhiteSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kWhiteSpace), last = text.find_last_not_of(kWhiteSpace);
  if (first == std::string_view::npos) return fail(FormatError::kBadProvenance, at, 0, '{');
  const auto byte_at = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (text[first] != '{') return fail(FormatError::kBadProvenance, at + first, byte_at(first), '{');
  if (text[last] != '}') return fail(FormatError::kBadProvenance, at + last, byte_at(last), '}');
  const std::size_t valid = utf8_prefix(text);
  if (valid != text.size()) return fail(FormatError::kBadProvenance, at + valid, byte_at(valid), 0x7f);
  return {};
}

/// @param objects that the file's instances may name, all of them valid.
/// @param records of the objects.
tl::expected<ValidateSummary, FormatIssue> validate_content(const BufferView& view, std::span<const BufferView> objects,
                                                            std::span<const ObjectRecord> records,
                                                            const ParallelLoop& loop) {
  if (auto single = check_instance_leaves(view); !single) return tl::unexpected(single.error());
  const auto tree = check_tree(view);
  if (!tree) return tl::unexpected(tree.error());
  const auto primitives = check_primitives(view);
  if (!primitives) return tl::unexpected(primitives.error());
  if (auto shapes = check_shapes(view); !shapes) return tl::unexpected(shapes.error());
  std::uint32_t need = tree->stack_need;
  if (view.has_instances()) {
    const auto all = check_instances(view, objects, records, need, loop);
    if (!all) return tl::unexpected(all.error());
    need = *all;
  }
  if (auto bound = check_stack_bound(view, need, need - tree->stack_need); !bound) return tl::unexpected(bound.error());
  return ValidateSummary{.nodes = view.node_count(),
                         .leaves = view.leaves.count,
                         .leaf_runs = tree->leaf_runs,
                         .leaf_triangles = primitives->leaf_triangles,
                         .leaf_customs = view.has_instances() ? 0 : primitives->leaf_customs,
                         .primitives = view.primitive_map.size(),
                         .dropped = primitives->dropped,
                         .split = primitives->split,
                         .depth = tree->depth,
                         .instances = view.has_instances() ? primitives->leaf_customs : 0,
                         .objects = view.objects.size(),
                         .shape_points = view.shape_points.size(),
                         .stack_need = need};
}

/// Checks a whole file.
/// @param objects, records see validate_content().
tl::expected<ValidateSummary, FormatIssue> validate_file(const BufferView& view, std::span<const BufferView> objects,
                                                         std::span<const ObjectRecord> records,
                                                         const ParallelLoop& loop) {
  if (const std::uint64_t sum = file_checksum(view.bytes); sum != view.header->checksum)
    return fail(FormatError::kBadChecksum, offsetof(FileHeader, checksum), view.header->checksum, sum);
  for (const auto check : {check_padding, check_features, check_provenance})
    if (auto good = check(view); !good) return tl::unexpected(good.error());
  return validate_content(view, objects, records, loop);
}

/// Checks the objects of a scene. An object has instances only of objects before it. Offsets in issues are the
/// scene's.
tl::expected<std::vector<BufferView>, FormatIssue> validate_objects(const BufferView& scene, const ParallelLoop& loop) {
  std::vector<BufferView> objects;
  const auto in_scene = [&](FormatIssue issue, std::size_t i) {
    issue.offset += scene.objects[i].offset;
    return tl::unexpected<FormatIssue>(issue);
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto object = open_buffer(scene.object_file(scene.objects[i]));
    if (!object) return in_scene(object.error(), i);
    if (!object->objects.empty() || object->layout() != scene.layout())
      return fail(FormatError::kBadObject, scene.objects[i].offset, object->header->layout, scene.header->layout);
    if (auto good = validate_file(*object, objects, scene.objects, loop); !good) return in_scene(good.error(), i);
    if (auto record = check_object_record(scene, i, *object); !record) return tl::unexpected(record.error());
    objects.push_back(*object);
  }
  return objects;
}

}  // namespace

tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes, const ParallelLoop& loop) {
  const auto view = open_buffer(bytes);
  if (!view) return tl::unexpected(view.error());
  const auto objects = validate_objects(*view, loop);
  if (!objects) return tl::unexpected(objects.error());
  return validate_file(*view, *objects, view->objects, loop);
}

tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes) {
  return validate(bytes, [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = 0; i < count; ++i) body(i);
  });
}

}  // namespace hiprt
