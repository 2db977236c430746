#include <hiprt_build/pipeline/gpu_file.h>

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/file_layout.h>
#include <hiprt_device/format/buffer.h>

#include <nlohmann/json.hpp>

#include <cstring>

namespace hiprt::build {
namespace {

using Json = nlohmann::ordered_json;

std::string make_provenance(std::string_view tool, const Json& statistics) {
  const Json document = {{"tool", tool.empty() ? "hiprt_build" : std::string(tool)},
                         {"library", std::string("hiprt ") + version()},
                         {"device", "gpu"},
                         {"statistics", statistics}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string make_provenance(const gpu::BuildReport& report, std::string_view tool) {
  return make_provenance(tool, {{"builder", name(report.builder)},
                                {"dropped_not_finite", report.dropped_not_finite},
                                {"dropped_degenerate", report.dropped_degenerate},
                                {"pairs", report.pairs},
                                {"nodes", report.nodes},
                                {"leaves", report.leaves}});
}

}  // namespace

std::string instance_provenance(const gpu::InstanceReport& report, std::string_view tool) {
  return make_provenance(tool, {{"instances", report.instances}, {"nodes", report.nodes}, {"leaves", report.leaves}});
}

Buffer complete_file(std::span<const std::byte> bytes, const gpu::BuildReport& report, std::string_view tool) {
  const std::string provenance = make_provenance(report, tool);
  SectionEntry section{};
  std::memcpy(&section, bytes.data() + sizeof(FileHeader) + kProvenanceAt * sizeof(SectionEntry), sizeof(section));
  section.count = provenance.size();
  Buffer buffer(section.offset + section.count);
  std::byte* to = buffer.bytes().data();
  std::memcpy(to, bytes.data(), bytes.size());
  std::memcpy(to + section.offset, provenance.data(), provenance.size());
  std::memcpy(to + sizeof(FileHeader) + kProvenanceAt * sizeof(SectionEntry), &section, sizeof(section));
  auto& header = *reinterpret_cast<FileHeader*>(to);
  header.byte_size = buffer.size();
  header.checksum = file_checksum(buffer.bytes());
  return buffer;
}

}  // namespace hiprt::build
