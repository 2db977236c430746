#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/build.h>

#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/pipeline/gpu_build_job.h>
#include <hiprt_build/pipeline/gpu_file.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

constexpr unsigned kMoveBlock = 256;
/// Bytes of the header and the section table.
constexpr std::uint64_t kHeadSize = FileLayout::head_size(kTreeSections);

/// Nodes whose children move by so many bytes: for a file whose gaps are closed.
template <class Node>
__global__ void __launch_bounds__(kMoveBlock)
    move_nodes(NodeArray<const Node> from, NodeArray<Node> to, std::uint32_t count, std::uint64_t leaves_from,
               std::uint32_t leaves_back) {
  const std::uint32_t i = blockIdx.x * kMoveBlock + threadIdx.x;
  if (i >= count) return;
  Node node = from[i];
  for (unsigned c = 0; c < kBranching; ++c)
    if (node.child[c] != kInvalidRef && ref_offset(node.child[c]) >= leaves_from) node.child[c] -= leaves_back << 3;
  to[i] = node;
}

/// @param gaps between the nodes.
__global__ void __launch_bounds__(kMoveBlock) clear_node_gaps(NodeArray<PlanesBoxNode> nodes, std::uint64_t gaps) {
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kMoveBlock + threadIdx.x;
  if (i < gaps) nodes.clear_gap(i);
}

/// A report with the head of its file.
struct Downloaded {
  BuildReport report;
  std::array<std::byte, kHeadSize> head;

  FileHeader& header() { return *reinterpret_cast<FileHeader*>(head.data()); }
  SectionEntry* sections() { return reinterpret_cast<SectionEntry*>(head.data() + sizeof(FileHeader)); }
};

Result<void> wait(hipStream_t stream) { return check(hipStreamSynchronize(stream), "hipStreamSynchronize"); }

Result<void> copy(void* to, const void* from, std::size_t bytes, hipMemcpyKind kind, hipStream_t stream) {
  if (bytes == 0) return {};
  return check(hipMemcpyAsync(to, from, bytes, kind, stream), "hipMemcpyAsync", bytes, " bytes");
}

/// Copies the sections of a file with gaps into one without.
template <class Layout>
Result<void> move_sections(const Downloaded& from, const FileLayout& file, std::byte* to, hipStream_t stream) {
  using Node = typename Layout::Node;
  const auto* sections = reinterpret_cast<const SectionEntry*>(from.head.data() + sizeof(FileHeader));
  const std::byte* base = from.report.view.base;
  const std::uint64_t back = sections[kLeavesAt].offset - file[kLeavesAt].offset;
  auto done =
      launch(move_nodes<Node>, std::uint64_t{from.report.nodes}, stream, {.block = kMoveBlock, .name = "move_nodes"},
             NodeArray<const Node>(base + sections[kNodesAt].offset, NodePlaces(sections[kNodesAt], Layout::kId)),
             NodeArray<Node>(to + file[kNodesAt].offset, NodePlaces(file[kNodesAt], Layout::kId)), from.report.nodes,
             sections[kLeavesAt].offset, static_cast<std::uint32_t>(back / kNodeGranularity));
  if (done) done = clear_gaps(to, file, Layout::kId, stream);
  for (unsigned i = kLeavesAt; i < kProvenanceAt && done; ++i)
    done = copy(to + file[i].offset, base + sections[i].offset, file[i].count * file[i].stride, hipMemcpyDeviceToDevice,
                stream);
  return done;
}

}  // namespace

Result<void> clear_gaps(std::byte* base, const FileLayout& file, NodeLayout layout, hipStream_t stream) {
  const NodePlaces places(file[kNodesAt], layout);
  if (const std::uint64_t gaps = places.gaps(places.nodes(file[kNodesAt])); gaps != 0)
    if (auto done = launch(clear_node_gaps, gaps, stream, {.block = kMoveBlock, .name = "clear_node_gaps"},
                           NodeArray<PlanesBoxNode>(base + file[kNodesAt].offset, places), gaps);
        !done)
      return done;
  std::uint64_t end = kHeadSize;
  for (const SectionEntry& section : file) {
    const std::uint64_t gap = std::min(section.offset, file.byte_size()) - std::min(end, file.byte_size());
    if (gap != 0)
      if (auto done = check(hipMemsetAsync(base + end, 0, gap, stream), "hipMemsetAsync", gap, " bytes"); !done)
        return done;
    end = section.offset + section.count * section.stride;
  }
  return {};
}

Result<void> check_report(const BuildReport& report) {
  if (report.status == BuildStatus::kTooDeep)
    return fail(ErrorCode::kTooLarge, "the tree needs ", report.view.stack_bound, " stack entries, the limit is ",
                build::kMaxStackBound);
  if (report.status == BuildStatus::kTooLarge)
    return fail(
        ErrorCode::kInvalidInput,
        "a coordinate of 2^126 (8.5e37) or more, which node layout quantized cannot hold; float, planes and half can");
  if (report.status == BuildStatus::kBadTree)
    return fail(ErrorCode::kInvalidInput, "the imported nodes do not form a tree: see node ", report.bad_node,
                " (numbers from the number of nodes on are leaves)");
  return {};
}

Result<BuiltScene> compact(const BuildReport* report, hipStream_t stream, Allocator& allocator) {
  Downloaded from;
  auto done = copy(&from.report, report, sizeof(from.report), hipMemcpyDeviceToHost, stream);
  if (done) done = wait(stream);
  if (done) done = check_report(from.report);
  if (done) done = copy(from.head.data(), from.report.view.base, kHeadSize, hipMemcpyDeviceToHost, stream);
  if (done) done = wait(stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  const SceneView& view = from.report.view;
  const FileLayout file = tree_layout(view.layout, {from.report.nodes, from.report.leaves,
                                                    from.header().primitive_count, from.header().geometry_count});
  auto buffer = DeviceBuffer::make(file.byte_size(), stream, allocator);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  std::byte* to = buffer->data();
  done = dispatch_layout(view.layout,
                         [&](auto layout) { return move_sections<decltype(layout)>(from, file, to, stream); });
  FileHeader& header = from.header();
  if (header.root != kInvalidRef && ref_offset(header.root) >= from.sections()[kLeavesAt].offset)
    header.root = make_ref(file[kLeavesAt].offset, ref_type(header.root));
  header.byte_size = file.byte_size();
  std::copy_n(file.begin(), kTreeSections, from.sections());
  if (done) done = copy(to, from.head.data(), kHeadSize, hipMemcpyHostToDevice, stream);
  if (done) done = wait(stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  BuiltScene scene{std::move(*buffer), view, from.report};
  scene.view.base = to;
  scene.view.size = file.byte_size();
  scene.view.geometries = reinterpret_cast<const GeometryRecord*>(to + file[kGeometriesAt].offset);
  scene.view.root = header.root;
  scene.report.view = scene.view;
  return scene;
}

Result<build::Buffer> download_file(const BuiltScene& scene, std::string_view tool, hipStream_t stream) {
  try {
    std::vector<std::byte> bytes(scene.buffer.size());
    if (auto copied = scene.buffer.download(bytes, stream); !copied) return tl::unexpected(std::move(copied.error()));
    if (auto passed = wait(stream); !passed) return tl::unexpected(std::move(passed.error()));
    return build::complete_file(bytes, scene.report, tool);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, scene.buffer.size(), " bytes of host memory wanted for a download");
  }
}

}  // namespace hiprt::gpu
