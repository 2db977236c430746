#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/hiprt_api/geometry.h>
#include <hiprt_build/hiprt_api/kernels.h>

namespace hiprt::api {
namespace {

/// What the host must know of a tree before it can be refitted.
struct Head {
  gpu::BuildReport report;
  FileHeader header;
  SectionEntry sections[4];
};

Result<void> read(void* to, const void* from, std::size_t bytes, hipStream_t stream) {
  auto copied = gpu::check(hipMemcpyAsync(to, from, bytes, hipMemcpyDeviceToHost, stream), "hipMemcpyAsync");
  return copied ? gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize") : copied;
}

Result<gpu::SceneParts> parts_of(const Member& member, hipStream_t stream) {
  Head head;
  auto done = read(&head.report, member.report, sizeof(head.report), stream);
  if (done && head.report.status != gpu::BuildStatus::kOk && head.report.status != gpu::BuildStatus::kBadIndex)
    return gpu::SceneParts{};
  if (done) done = read(&head.header, member.storage, sizeof(head.header) + sizeof(head.sections), stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  return gpu::SceneParts{.base = member.storage,
                         .layout = head.report.view.layout,
                         .root = head.report.view.root,
                         .first_node = head.sections[kNodesAt].offset,
                         .nodes = head.report.nodes,
                         .node_gaps = NodePlaces(head.sections[kNodesAt], head.report.view.layout).has_gaps(),
                         .first_leaf = head.sections[kLeavesAt].offset,
                         .leaves = head.report.leaves,
                         .geometries = head.report.view.geometries,
                         .geometry_count = head.report.geometries};
}

}  // namespace

Result<bool> refit_geometry(const Found& found, const gpu::DeviceGeometry& moved, std::byte* scratch,
                            hipStream_t stream) {
  static_assert(offsetof(Head, sections) == offsetof(Head, header) + sizeof(FileHeader));
  static_assert(kNodesAt < 4 && kLeavesAt < 4);
  Member& member = found.member();
  if (!member.parts) {
    const auto read = parts_of(member, stream);
    if (!read) return tl::unexpected(read.error());
    member.parts = std::make_unique<gpu::SceneParts>(*read);
  }
  const gpu::SceneParts* const parts = member.parts.get();
  if (parts->root == kInvalidRef || parts->geometry_count != 1) return false;
  const auto refitted = gpu::enqueue_refit(*parts, {&moved, 1}, scratch, stream);
  if (!refitted) return tl::unexpected(refitted.error());
  // Compaction copies the view of the build's report.
  auto* const view = const_cast<SceneView*>(&member.report->view);
  if (auto done = enqueue_refitted(*refitted, view, found.header(), stream); !done)
    return tl::unexpected(std::move(done.error()));
  gpu::RefitStatus status{};
  if (auto done = read(&status, &(*refitted)->status, sizeof(status), stream); !done)
    return tl::unexpected(std::move(done.error()));
  return status == gpu::RefitStatus::kOk;
}

}  // namespace hiprt::api
