#include <hiprt_build/buffer.h>
#include <hiprt_build/encode/encode.h>
#include <hiprt_build/encode/widen_boxes.h>
#include <hiprt_build/encode/write_nodes.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/input/provenance.h>
#include <hiprt_build/statistics/tree_quality.h>
#include <hiprt_device/format/buffer.h>

#include <cstring>

namespace hiprt::build {
namespace {

/// Bytes that are cleared or summed up in less than a millisecond.
constexpr std::size_t kPiece = std::size_t{1} << 20;
constexpr std::uint32_t kShapeSections = 3;

/// The sections of the file: those of every file, then those of shapes if there are any.
FileLayout plan_file(const EncodeInput& input, std::uint64_t nodes) {
  bool shapes = false;
  std::uint64_t points = 0, segments = 0;
  for (const CustomGeometry& custom : input.scene.customs) {
    shapes = shapes || custom.shapes.kind != ShapeKind::kNone;
    points += custom.shapes.points.size();
    segments += custom.shapes.segments.size();
  }
  const std::uint64_t geometries = input.scene.geometries.size();
  FileLayout file = tree_layout(
      input.layout,
      {nodes, input.tree.references.size(), input.scene.primitive_count(), geometries, input.provenance.size()},
      shapes ? kShapeSections : 0);
  if (!shapes) return file;
  file.add(SectionKind::kShapes, geometries, sizeof(ShapeRecord), 0);
  file.add(SectionKind::kShapePoints, points, sizeof(ShapePoint), 0);
  file.add(SectionKind::kCurveSegments, segments, sizeof(std::uint32_t), 0);
  return file;
}

/// Geometry table. @return the features it calls for.
FeatureMask write_geometries(const EncodeInput& input, GeometryRecord* records) {
  FeatureMask features = 0;
  for (std::size_t i = 0; i < input.scene.geometries.size(); ++i) {
    const GeometryView& geometry = input.scene.geometries[i];
    records[i] = GeometryRecord{geometry.first, geometry.primitive_count, input.paired.dropped[i], geometry.mask,
                                geometry.flags};
    if (geometry.mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  }
  return features;
}

/// The sections of shapes, if there are any.
void write_shapes(CpuEngine& engine, const BuildInput& scene, const FileLayout& file, std::byte* bytes) {
  if (file.count() == kTreeSections) return;
  auto* record = reinterpret_cast<ShapeRecord*>(bytes + file[kTreeSections].offset) + scene.meshes.size();
  std::uint64_t points = file[kTreeSections + 1].offset, segments = file[kTreeSections + 2].offset;
  for (const CustomGeometry& custom : scene.customs) {
    const Shapes& shapes = custom.shapes;
    const bool numbers = segment_numbers(shapes.kind) != 0;
    if (shapes.kind != ShapeKind::kNone)
      *record = {
          points, numbers ? segments : 0, static_cast<std::uint32_t>(shapes.points.size()), shapes.kind, shapes.keys,
          0};
    ++record;
    engine.copy(shapes.points, std::span(reinterpret_cast<ShapePoint*>(bytes + points), shapes.points.size()));
    engine.copy(shapes.segments, std::span(reinterpret_cast<std::uint32_t*>(bytes + segments), shapes.segments.size()));
    points += shapes.points.size_bytes();
    segments += shapes.segments.size_bytes();
  }
}

FileHeader make_header(const EncodeInput& input, const FileLayout& file, const Subtree& root, FeatureMask features) {
  FileHeader header{};
  std::copy_n(kMagic, sizeof(kMagic), header.magic);
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(input.layout);
  const std::size_t references = input.tree.references.size();
  if (input.paired.count > input.paired.custom_count) features |= feature_bit(Feature::kTriangles);
  if (input.paired.custom_count != 0) features |= feature_bit(Feature::kCustom);
  if (references > input.paired.count) features |= feature_bit(Feature::kSplitReferences);
  header.features = features;
  header.byte_size = file.byte_size();
  header.section_count = file.count();
  header.root = root.child.ref;
  header.stack_bound = root.stack_need;
  header.geometry_count = static_cast<std::uint32_t>(input.scene.geometries.size());
  header.bounds = root.child.box;
  header.primitive_count = input.scene.primitive_count();
  return header;
}

/// Of the tree that is in the file.
template <class Layout> double exchange_slack(CpuEngine& engine, const FileLayout& file, const std::byte* bytes) {
  const SectionEntry &nodes = file[kNodesAt], &leaves = file[kLeavesAt];
  const NodePlaces places(nodes, Layout::kId);
  const TreeQuality<Layout> quality{reinterpret_cast<const FileHeader*>(bytes),
                                    NodeArray<const typename Layout::Node>(bytes + nodes.offset, places),
                                    reinterpret_cast<const typename Layout::Leaf*>(bytes + leaves.offset),
                                    nodes.offset,
                                    leaves.offset,
                                    {}};
  return sum_quality(engine, quality, places.nodes(nodes)).exchange_slack();
}

}  // namespace

Result<void> check_addresses(NodeLayout layout, std::uint64_t nodes, std::uint64_t leaves) {
  const std::uint64_t end = tree_layout(layout, {nodes, leaves})[kLeavesAt].offset + leaves * sizeof(FloatLeaf);
  if (end <= kAddressLimit) return {};
  return tl::unexpected(Error{
      ErrorCode::kTooLarge, std::to_string(nodes) + " nodes and " + std::to_string(leaves) + " leaves end at byte " +
                                std::to_string(end) + ", a node reference addresses " + std::to_string(kAddressLimit)});
}

Result<Buffer> encode(CpuEngine& engine, const EncodeInput& input) {
  const std::size_t leaves = input.tree.references.size();
  const std::uint64_t nodes = leaves == 0 || input.wide.is_run(0) ? 0 : input.wide.node_count(0);
  if (auto addresses = check_addresses(input.layout, nodes, leaves); !addresses)
    return tl::unexpected(addresses.error());
  const FileLayout file = plan_file(input, nodes);
  engine.monitor().start("encode", 0.95, leaves);
  engine.ledger().add(file.byte_size());
  Buffer buffer = Buffer::uninitialized(file.byte_size());
  std::byte* bytes = buffer.bytes().data();
  engine.for_quiet_chunks(
      buffer.size(),
      [&](std::size_t, std::size_t begin, std::size_t end) { std::memset(bytes + begin, 0, end - begin); }, kPiece);
  const Subtree root = dispatch_layout(
      input.layout, [&](auto layout) { return NodeWriter<decltype(layout)>(engine, input, file, bytes).run(); });
  const FeatureMask features =
      write_geometries(input, reinterpret_cast<GeometryRecord*>(bytes + file[kGeometriesAt].offset));
  write_shapes(engine, input.scene, file, bytes);
  std::memcpy(bytes + sizeof(FileHeader), file.begin(), file.count() * sizeof(SectionEntry));
  auto& header = *reinterpret_cast<FileHeader*>(bytes);
  header = make_header(input, file, root, features);
  if (input.widen_boxes) widen_file(engine, bytes, file[kNodesAt].offset, nodes);
  std::byte* provenance = bytes + file[kProvenanceAt].offset;
  std::memcpy(provenance, input.provenance.data(), input.provenance.size());
  const double slack =
      dispatch_layout(input.layout, [&](auto layout) { return exchange_slack<decltype(layout)>(engine, file, bytes); });
  set_exchange_slack({reinterpret_cast<char*>(provenance), input.provenance.size()}, slack);
  engine.monitor().start("checksum", 1.0, 1);
  header.checksum = file_checksum(buffer.bytes(), kPiece, [&] { engine.monitor().check(); });
  return buffer;
}

}  // namespace hiprt::build
