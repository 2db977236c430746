#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/instances.h>

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/instances/gpu_instance_layout.h>
#include <hiprt_build/instances/instance_fault.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace hiprt::gpu {
namespace {

/// Sections of a scene's file besides those of its tree. They take the place of the provenance.
constexpr std::uint32_t kInstancesAt = kProvenanceAt, kObjectsAt = kInstancesAt + 1, kObjectFilesAt = kObjectsAt + 1,
                        kSceneSections = kObjectFilesAt + 1;

/// The file without gaps.
FileLayout scene_layout(const InstanceReport& report, std::uint64_t objects, std::uint64_t object_bytes) {
  const FileLayout tree = tree_layout(report.view.layout, {report.nodes, report.leaves, report.instances, 1},
                                      kSceneSections - kTreeSections);
  FileLayout file(kSceneSections);
  for (std::uint32_t i = 0; i < kProvenanceAt; ++i) file.keep(tree[i], tree[i].offset + tree[i].count * tree[i].stride);
  file.add(SectionKind::kInstances, report.instances, sizeof(InstanceRecord));
  file.add(SectionKind::kObjects, objects, sizeof(ObjectRecord));
  file.add(SectionKind::kObjectFiles, object_bytes, 1, kSectionRequired, kBufferAlignment);
  return file;
}

/// Copies to the host, one after the other.
class Downloader {
 public:
  explicit Downloader(hipStream_t stream) : stream_(stream) {}

  void copy(void* to, const void* from, std::uint64_t bytes) {
    if (result_ && bytes != 0)
      result_ = check(hipMemcpyAsync(to, from, static_cast<std::size_t>(bytes), hipMemcpyDeviceToHost, stream_),
                      "hipMemcpyAsync", bytes, " bytes");
  }
  Result<void> wait() {
    if (result_) result_ = check(hipStreamSynchronize(stream_), "hipStreamSynchronize");
    return result_;
  }

 private:
  hipStream_t stream_;
  Result<void> result_{};
};

/// A reference to what has moved.
NodeRef moved(NodeRef ref, const FileLayout& from, const FileLayout& to) {
  if (ref == kInvalidRef) return ref;
  const std::uint64_t at = ref_offset(ref);
  const unsigned section = at >= from[kLeavesAt].offset ? kLeavesAt : kNodesAt;
  return make_ref(at - from[section].offset + to[section].offset, ref_type(ref));
}

void write_header(std::byte* bytes, const InstanceReport& report, const FileLayout& from, const FileLayout& to) {
  const SceneView& view = report.view;
  FileHeader header{};
  std::memcpy(header.magic, kMagic, sizeof(kMagic));
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(view.layout);
  header.features = view.features;
  header.byte_size = to.byte_size();
  header.section_count = to.count();
  header.root = moved(view.root, from, to);
  header.stack_bound = view.stack_bound;
  header.geometry_count = 1;
  header.bounds = view.bounds;
  header.primitive_count = report.instances;
  header.levels = view.levels;
  header.condition = view.condition;
  header.reach = view.reach;
  header.shutter_begin = view.shutter_begin;
  header.shutter_rate = view.shutter_rate;
  std::memcpy(bytes, &header, sizeof(header));
  std::memcpy(bytes + sizeof(header), to.begin(), to.count() * sizeof(SectionEntry));
}

void move_children(std::byte* nodes, const InstanceReport& report, const FileLayout& from, const FileLayout& to) {
  dispatch_layout(report.view.layout, [&](auto layout) {
    auto* records = reinterpret_cast<typename decltype(layout)::Node*>(nodes);
    for (std::uint32_t i = 0; i < report.nodes; ++i)
      for (NodeRef& child : records[i].child) child = moved(child, from, to);
  });
}

/// What the message says of the instance.
std::string describe(const InstanceReport& report, std::uint32_t objects) {
  switch (report.status) {
    case InstanceStatus::kNotFinite:
    case InstanceStatus::kNoInverse:
      return build::describe_fault(static_cast<build::TransformFault>(report.status), report.determinant,
                                   report.condition);
    case InstanceStatus::kBadObject:
      return "object " + std::to_string(report.object) + ", the scene has " + std::to_string(objects);
    case InstanceStatus::kBadFlags:
      return "flags that are none of InstanceFlags";
    default:
      return "its bounds are beyond what floats hold";
  }
}

}  // namespace

Result<InstanceReport> read_report(const InstanceReport* report, const SceneObjects& objects, hipStream_t stream) {
  InstanceReport read;
  Downloader device(stream);
  device.copy(&read, report, sizeof(read));
  if (auto done = device.wait(); !done) return tl::unexpected(std::move(done.error()));
  switch (read.status) {
    case InstanceStatus::kOk:
      return read;
    case InstanceStatus::kIllConditioned:
      return fail(ErrorCode::kInvalidInput, build::describe_condition(read.condition));
    case InstanceStatus::kTooDeep:
      return fail(ErrorCode::kTooLarge,
                  "the tree over instances is too deep: a traversal would need more than 180 "
                  "stack entries besides those of objects");
    case InstanceStatus::kTooLarge:
      return fail(ErrorCode::kInvalidInput,
                  "a coordinate of 2^126 (8.5e37) or more, which node layout quantized "
                  "cannot hold; float, planes and half can");
    default:
      return fail(ErrorCode::kInvalidInput, "instance ", read.instance, ": ", describe(read, objects.count));
  }
}

Result<build::Buffer> download_file(const InstanceReport& report, const SceneObjects& objects, hipStream_t stream) {
  try {
    Downloader device(stream);
    std::vector<ObjectRecord> records(objects.count);
    device.copy(records.data(), objects.records, records.size() * sizeof(ObjectRecord));
    if (auto done = device.wait(); !done) return tl::unexpected(std::move(done.error()));
    const std::vector<ObjectRecord> there = records;
    std::uint64_t object_bytes = 0;
    for (ObjectRecord& record : records) {
      record.offset = align_up(object_bytes, kBufferAlignment);
      object_bytes = record.offset + record.size;
    }
    const FileLayout file = scene_layout(report, objects.count, object_bytes);
    const FileLayout from = output_tree_layout(report.view.layout, report.instances);
    build::Buffer buffer(static_cast<std::size_t>(file.byte_size()));
    std::byte* bytes = buffer.bytes().data();
    for (unsigned i = 0; i < kProvenanceAt; ++i)
      device.copy(bytes + file[i].offset, report.view.base + from[i].offset, file[i].count * file[i].stride);
    device.copy(bytes + file[kInstancesAt].offset, report.view.instances, report.instances * sizeof(InstanceRecord));
    for (std::size_t i = 0; i < records.size(); ++i) {
      records[i].offset += file[kObjectFilesAt].offset;
      device.copy(bytes + records[i].offset, objects.base + there[i].offset, records[i].size);
    }
    if (auto done = device.wait(); !done) return tl::unexpected(std::move(done.error()));
    std::memcpy(bytes + file[kObjectsAt].offset, records.data(), records.size() * sizeof(ObjectRecord));
    move_children(bytes + file[kNodesAt].offset, report, from, file);
    write_header(bytes, report, from, file);
    reinterpret_cast<FileHeader*>(bytes)->checksum = file_checksum(std::as_const(buffer).bytes());
    return buffer;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no host memory for the file of a scene of ", report.instances, " instances");
  }
}

}  // namespace hiprt::gpu
