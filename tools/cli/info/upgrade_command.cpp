#include <tools/cli/info/upgrade_command.h>

#include <tools/base/errors.h>
#include <tools/base/output_file.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/checksum.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <iostream>
#include <vector>

namespace hiprt::tools {
namespace {

std::string version_text(std::uint32_t minor) { return std::to_string(kVersionMajor) + "." + std::to_string(minor); }

/// A file within the bytes of the input: the scene's, or an object's.
struct FileRange {
  std::size_t offset, size;
  std::uint32_t minor;
};

/// The objects' files, then the whole one, whose checksum covers theirs.
std::vector<FileRange> files_of(const BufferView& view) {
  std::vector<FileRange> files;
  for (const ObjectRecord& object : view.objects) {
    const auto* header = reinterpret_cast<const FileHeader*>(view.bytes.data() + object.offset);
    files.push_back({object.offset, object.size, header->version_minor});
  }
  files.push_back({0, view.bytes.size(), view.header->version_minor});
  return files;
}

/// Writes the newest version into a header. @param file that was valid before.
void upgrade(std::span<std::byte> file) {
  auto* header = reinterpret_cast<FileHeader*>(file.data());
  header->version_minor = kVersionMinor;
  header->checksum = file_checksum(file);
}

void report(const Cli& cli, const std::string& input, const std::string& output, std::uint32_t oldest) {
  const bool upgraded = oldest != kVersionMinor;
  if (cli.json()) {
    cli.print({{"file", output},
               {"from", {kVersionMajor, oldest}},
               {"version", {kVersionMajor, kVersionMinor}},
               {"upgraded", upgraded}});
    return;
  }
  if (upgraded)
    std::cout << input << ": version " << version_text(oldest) << "; " << output << " has version "
              << version_text(kVersionMinor) << "\n";
  else
    std::cout << input << ": has the newest version, " << version_text(oldest) << ", already; " << output
              << " is a copy\n";
}

}  // namespace

build::Result<void> run_upgrade(const Cli& cli, const std::string& input, const std::string& output,
                                std::uint64_t max_memory) {
  if (auto checked = check_output(output, {&input, 1}); !checked) return checked;
  const auto file = load_bvh(input, max_memory);
  if (!file) return tl::unexpected(file.error());
  const std::vector<FileRange> files = files_of(file->view);
  const auto [oldest, newest] = std::minmax_element(
      files.begin(), files.end(), [](const FileRange& a, const FileRange& b) { return a.minor < b.minor; });
  if (newest->minor > kVersionMinor)
    return invalid_input(input + ": " + (newest->offset == 0 ? "" : "an object in it ") + "has version " +
                         version_text(newest->minor) + ", and this program knows versions up to " +
                         version_text(kVersionMinor) + ": use the program of a newer release");
  build::Buffer copy = build::Buffer::uninitialized(file->view.bytes.size());
  std::memcpy(copy.bytes().data(), file->view.bytes.data(), copy.size());
  if (oldest->minor != kVersionMinor)
    for (const FileRange& range : files) upgrade(copy.bytes().subspan(range.offset, range.size));
  if (auto written = build::write_file(output, copy.bytes()); !written) return written;
  report(cli, input, output, oldest->minor);
  return {};
}

}  // namespace hiprt::tools
