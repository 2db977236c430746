#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/instances.h>

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/instances/gpu_instance_layout.h>
#include <hiprt_build/instances/instance_fault.h>
#include <hiprt_build/instances/pack_object.h>
#include <hiprt_build/pipeline/gpu_file.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

namespace hiprt::gpu {
namespace {

using build::PackedObject;

/// Positions in scene_layout(), behind those of the tree. They take the place of the provenance.
constexpr std::uint32_t kInstancesAt = kProvenanceAt, kObjectsAt = kInstancesAt + 1, kObjectFilesAt = kObjectsAt + 1,
                        kOriginAt = kObjectFilesAt + 1, kMotionsAt = kOriginAt + 1, kSegmentsAt = kMotionsAt + 1;

/// The file without gaps. @param segments 0: nothing moves. @param provenance its bytes.
FileLayout scene_layout(const InstanceReport& report, std::uint64_t objects, std::uint64_t object_bytes,
                        std::uint64_t segments, std::uint64_t provenance) {
  FileLayout file(segments == 0 ? kMotionsAt : kSegmentsAt + 1);
  file.add_nodes(report.view.layout, report.nodes);
  file.add(SectionKind::kLeaves, report.leaves, sizeof(CustomLeaf));
  file.add(SectionKind::kPrimitiveMap, report.instances, sizeof(std::uint32_t));
  file.add(SectionKind::kGeometries, 1, sizeof(GeometryRecord));
  file.add(SectionKind::kInstances, report.instances, sizeof(InstanceRecord));
  file.add(SectionKind::kObjects, objects, sizeof(ObjectRecord));
  file.add(SectionKind::kObjectFiles, object_bytes, 1, kSectionRequired, kBufferAlignment);
  file.add(SectionKind::kProvenance, provenance, 1, 0);
  if (segments == 0) return file;
  file.add(SectionKind::kMotions, report.instances, sizeof(MotionRecord));
  file.add(SectionKind::kMotionSegments, segments, sizeof(MotionSegment));
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
    using Node = typename decltype(layout)::Node;
    const NodeArray<Node> records(nodes, NodePlaces(to[kNodesAt], report.view.layout));
    for (std::uint64_t i = 0; i < records.places().gaps(report.nodes); ++i) records.clear_gap(i);
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
    case InstanceStatus::kBadMotion:
      return build::describe_fault(report.motion_fault, report.key, report.determinant);
    case InstanceStatus::kOtherLayout:
      return "object " + std::to_string(report.object) + " has another node layout than the scene's objects";
    case InstanceStatus::kOtherShutter:
      return "object " + std::to_string(report.object) +
             " has moving boxes; give their shutter to SceneObjects, or build it without motion";
    case InstanceStatus::kNotInTree:
      return "it was empty when the tree was built, and is not now; build the tree again";
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

namespace {

/// A scene of instances on its way to a file.
class SceneDownload {
 public:
  SceneDownload(const InstanceReport& report, const SceneObjects& objects, hipStream_t stream, std::string_view tool)
      : report_(report),
        objects_(objects),
        device_(stream),
        tool_(tool),
        from_(output_tree_layout(report.view.layout, report.instances)) {}

  Result<build::Buffer> run() {
    instances_.resize(report_.instances);
    there_.resize(objects_.count);
    std::vector<MotionRecord> motions(report_.view.motions == nullptr ? 0 : report_.instances);
    copy(instances_, report_.view.instances);
    copy(there_, objects_.records);
    copy(motions, report_.view.motions);
    if (auto done = device_.wait(); !done) return tl::unexpected(std::move(done.error()));
    if (auto done = read_segments(motions); !done) return tl::unexpected(std::move(done.error()));
    if (auto done = plan_objects(); !done) return tl::unexpected(std::move(done.error()));
    return write();
  }

 private:
  template <class T> void copy(std::vector<T>& to, const T* from) {
    device_.copy(to.data(), from, to.size() * sizeof(T));
  }

  Result<void> read_segments(const std::vector<MotionRecord>& motions) {
    std::uint64_t begin = ~std::uint64_t{0}, end = 0;
    for (const MotionRecord& motion : motions) {
      if (motion.count == 0) continue;
      begin = std::min(begin, motion.segments);
      end = std::max(end, motion.segments + motion.count * sizeof(MotionSegment));
    }
    if (end == 0) return {};
    std::vector<MotionSegment> segments(static_cast<std::size_t>((end - begin) / sizeof(MotionSegment)));
    copy(segments, reinterpret_cast<const MotionSegment*>(report_.view.base + begin));
    if (auto done = device_.wait(); !done) return done;
    motions_ = build::pack_motions(motions, [&](std::uint64_t offset) {
      return segments[static_cast<std::size_t>((offset - begin) / sizeof(MotionSegment))];
    });
    return {};
  }

  /// Whether the objects lie in one file's copy, and need no packing.
  bool is_file() const { return objects_.base != nullptr; }

  /// The records, with offsets that count from the first object's file.
  Result<void> plan_objects() {
    if (is_file())
      records_ = there_;
    else if (auto done = pack(); !done)
      return done;
    for (const PackedObject& object : packed_) records_.push_back(object.record);
    for (ObjectRecord& record : records_) {
      record.offset = align_up(object_bytes_, kBufferAlignment);
      object_bytes_ = record.offset + record.size;
    }
    return {};
  }

  Result<void> pack() {
    find_equal();
    std::map<std::pair<std::uint64_t, std::uint64_t>, std::vector<std::byte>> memory;
    for (const std::uint32_t i : order_) {
      const ObjectRecord& record = there_[i];
      std::vector<std::byte>& bytes = memory[{record.offset, record.size}];
      if (!bytes.empty() || record.root == kInvalidRef) continue;
      bytes.resize(static_cast<std::size_t>(record.size));
      copy(bytes, reinterpret_cast<const std::byte*>(static_cast<std::uintptr_t>(record.offset)));
    }
    if (auto done = device_.wait(); !done) return done;
    const auto memory_of = [&](std::uint32_t i) -> std::span<const std::byte> {
      return memory[{there_[i].offset, there_[i].size}];
    };
    std::map<std::uint32_t, std::vector<InstanceRecord>> inner;
    for (const std::uint32_t i : order_)
      if (there_[i].instances != 0) inner[i] = inner_instances(there_[i], memory_of(i));
    if (auto done = device_.wait(); !done) return done;
    if (auto done = order_objects(inner); !done) return done;
    for (const std::uint32_t i : order_) {
      auto object = build::pack_object(memory_of(i), inner[i], there_[i], objects_.layout, objects_.shutter_begin,
                                       objects_.shutter_rate, packed_);
      if (!object) return fail(object.error().code, "object ", i, ": ", object.error().message);
      packed_.push_back(std::move(*object));
    }
    return {};
  }

  /// Objects with equal records are one in the file.
  void find_equal() {
    std::map<std::string_view, std::uint32_t> known;
    number_.resize(there_.size());
    for (std::uint32_t i = 0; i < there_.size(); ++i) {
      const std::string_view record(reinterpret_cast<const char*>(&there_[i]), sizeof(ObjectRecord));
      const auto [at, is_new] = known.emplace(record, static_cast<std::uint32_t>(order_.size()));
      number_[i] = at->second;
      if (is_new) order_.push_back(i);
    }
  }

  /// The records of a scene inside. They may lie elsewhere than its tree. To be waited for.
  std::vector<InstanceRecord> inner_instances(const ObjectRecord& there, std::span<const std::byte> memory) {
    GeometryRecord geometry{};
    if (there.geometries > memory.size() || memory.size() - there.geometries < sizeof(geometry)) return {};
    std::memcpy(&geometry, memory.data() + there.geometries, sizeof(geometry));
    std::vector<InstanceRecord> records(static_cast<std::size_t>(geometry.primitive_count));
    // Modulo 2^64.
    copy(records, reinterpret_cast<const InstanceRecord*>(static_cast<std::uintptr_t>(there.offset + there.instances)));
    return records;
  }

  /// In a file, objects come before the scenes of them. Numbers of objects become those of the file.
  Result<void> order_objects(std::map<std::uint32_t, std::vector<InstanceRecord>>& inner) {
    bool ordered = true;
    for (const auto& [object, records] : inner)
      for (const InstanceRecord& record : records) {
        if (record.object >= there_.size())
          return fail(ErrorCode::kInvalidInput, "object ", object, ": an instance of object ", record.object,
                      ", the scene has ", there_.size());
        ordered = ordered && number_[record.object] < number_[object];
      }
    if (!ordered) {
      std::stable_sort(order_.begin(), order_.end(),
                       [&](std::uint32_t a, std::uint32_t b) { return there_[a].levels < there_[b].levels; });
      std::vector<std::uint32_t> place_of(order_.size());
      for (std::uint32_t place = 0; place < order_.size(); ++place) place_of[number_[order_[place]]] = place;
      for (std::uint32_t& number : number_) number = place_of[number];
    }
    for (auto& [object, records] : inner)
      for (InstanceRecord& record : records) record.object = number_[record.object];
    for (InstanceRecord& record : instances_) record.object = number_[record.object];
    return {};
  }

  Result<build::Buffer> write() {
    const std::string provenance = build::instance_provenance(report_, tool_);
    const FileLayout file =
        scene_layout(report_, records_.size(), object_bytes_, motions_.segments.size(), provenance.size());
    build::Buffer buffer(static_cast<std::size_t>(file.byte_size()));
    std::byte* bytes = buffer.bytes().data();
    for (unsigned i = 0; i < kProvenanceAt; ++i)
      device_.copy(bytes + file[i].offset, report_.view.base + from_[i].offset, file[i].count * file[i].stride);
    for (std::size_t i = 0; i < records_.size(); ++i) {
      records_[i].offset += file[kObjectFilesAt].offset;
      std::byte* to = bytes + records_[i].offset;
      if (is_file())
        device_.copy(to, objects_.base + there_[i].offset, records_[i].size);
      else
        std::memcpy(to, packed_[i].file.bytes().data(), packed_[i].file.size());
    }
    if (auto done = device_.wait(); !done) return tl::unexpected(std::move(done.error()));
    put(bytes, file[kInstancesAt], instances_);
    put(bytes, file[kObjectsAt], records_);
    put(bytes, file[kOriginAt], provenance);
    if (!motions_.segments.empty()) {
      for (MotionRecord& motion : motions_.records)
        if (motion.count != 0) motion.segments += file[kSegmentsAt].offset;
      put(bytes, file[kMotionsAt], motions_.records);
      put(bytes, file[kSegmentsAt], motions_.segments);
    }
    if (!is_file()) enter_packed(reinterpret_cast<CustomLeaf*>(bytes + file[kLeavesAt].offset));
    move_children(bytes + file[kNodesAt].offset, report_, from_, file);
    write_header(bytes, report_, from_, file);
    reinterpret_cast<FileHeader*>(bytes)->checksum = file_checksum(std::as_const(buffer).bytes());
    return buffer;
  }

  template <class Records> static void put(std::byte* bytes, const SectionEntry& section, const Records& records) {
    std::memcpy(bytes + section.offset, records.data(), static_cast<std::size_t>(section.count * section.stride));
  }

  /// Rays enter the packed objects at other nodes.
  void enter_packed(CustomLeaf* leaves) const {
    for (std::uint32_t i = 0; i < report_.leaves; ++i)
      leaves[i].info.primitive[1] = packed_[instances_[leaves[i].info.primitive[0]].object].record.root;
  }

  const InstanceReport& report_;
  const SceneObjects& objects_;
  Downloader device_;
  std::string_view tool_;
  FileLayout from_;  ///< Of the tree, in the output.
  std::vector<InstanceRecord> instances_;
  build::PackedMotions motions_;
  std::vector<ObjectRecord> there_, records_;
  std::vector<std::uint32_t> number_;  ///< In the file, of each object there.
  std::vector<std::uint32_t> order_;   ///< Objects there, as they follow one another in the file.
  std::vector<PackedObject> packed_;
  std::uint64_t object_bytes_ = 0;
};

}  // namespace

Result<build::Buffer> download_file(const InstanceReport& report, const SceneObjects& objects, hipStream_t stream,
                                    std::string_view tool) {
  try {
    return SceneDownload(report, objects, stream, tool).run();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no host memory for the file of a scene of ", report.instances, " instances");
  }
}

}  // namespace hiprt::gpu
