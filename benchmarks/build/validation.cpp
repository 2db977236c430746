#include "validation.h"

#include <benchmarks/common/rounds.h>

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>

#include <unistd.h>

#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace hiprt::bench {
namespace {

/// A file that is deleted at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name) : path_(std::filesystem::temp_directory_path() / name) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

build::Result<void> validate_file(const std::filesystem::path& path) {
  const auto file = build::map_file(path);
  if (!file) return tl::unexpected(file.error());
  if (const auto valid = validate(file->bytes()); !valid)
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + to_string(valid.error())});
  return {};
}

}  // namespace

build::Result<ValidationCell> measure_validation(const build::TriangleMesh& mesh, const std::string& scene,
                                                 unsigned rounds) {
  const TemporaryFile file("hiprt_bench_" + std::to_string(getpid()) + ".bvh");
  ValidationCell cell{scene, mesh.triangles.size(), 0, 0};
  {
    const auto bvh = build::build({&mesh, 1});
    if (!bvh) return tl::unexpected(bvh.error());
    cell.bytes = bvh->buffer.size();
    if (auto written = build::write_file(file.path(), bvh->buffer.bytes()); !written)
      return tl::unexpected(written.error());
  }
  std::vector<double> seconds;
  for (unsigned round = 0; round < rounds; ++round) {
    build::Result<void> valid;
    seconds.push_back(time_of([&] { valid = validate_file(file.path()); }));
    if (!valid) return tl::unexpected(valid.error());
  }
  cell.seconds = median(seconds);
  return cell;
}

}  // namespace hiprt::bench
