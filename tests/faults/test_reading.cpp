// Faults of the system while a file is read or mapped. The linker puts the functions below before the system's (--wrap,
// see CMakeLists.txt).

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/open_scene.h>
#include <tests/faults/failing_call.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/random.h>
#include <tests/tools/temp_folder.h>
#include <tools/base/read_input.h>
#include <tools/scene_io/ray_stream.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <system_error>
#include <vector>

using namespace hiprt;
namespace fs = std::filesystem;

using checks::fault;

// NOLINTBEGIN(clang-diagnostic-reserved-identifier)
extern "C" {
int __real_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const unsigned mode = (flags & O_CREAT) != 0 ? va_arg(list, unsigned) : 0;
  va_end(list);
  return fault.next("open") ? -1 : __real_open(path, flags, mode);
}
ssize_t __real_pread(int file, void* data, size_t bytes, off_t offset);
ssize_t __wrap_pread(int file, void* data, size_t bytes, off_t offset) {
  if (fault.next("pread")) return fault.error == 0 ? 0 : -1;
  return __real_pread(file, data, std::min(bytes, fault.most), offset);
}
int __real_fstat(int file, struct stat* status);
int __wrap_fstat(int file, struct stat* status) { return fault.next("fstat") ? -1 : __real_fstat(file, status); }
void* __real_mmap(void* at, size_t bytes, int protection, int flags, int file, off_t offset);
void* __wrap_mmap(void* at, size_t bytes, int protection, int flags, int file, off_t offset) {
  return fault.next("mmap") ? MAP_FAILED : __real_mmap(at, bytes, protection, flags, file, offset);
}
}
// NOLINTEND(clang-diagnostic-reserved-identifier)

namespace {

/// A function that reads a file.
struct Reader {
  std::string name;
  std::string content;                                              ///< Of a file that it accepts.
  std::function<build::Result<std::string>(const fs::path&)> read;  ///< @return the content.
};

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

build::Result<std::string> text_of(const build::Result<build::Buffer>& file) {
  if (!file) return tl::unexpected(file.error());
  return text_of(file->bytes());
}

build::Result<std::string> stream_rays(const fs::path& path) {
  const auto stream = tools::RayStream::open(path);
  if (!stream) return tl::unexpected(stream.error());
  const auto rays = stream->read(0, static_cast<std::size_t>(stream->count()));
  if (!rays) return tl::unexpected(rays.error());
  std::string text;
  test::append(text, static_cast<std::uint32_t>(rays->size()), stream->any_hit() ? 1u : 0u);
  for (const Ray& ray : *rays)
    test::append(text, ray.origin.x, ray.origin.y, ray.origin.z, ray.tmin, ray.direction.x, ray.direction.y,
                 ray.direction.z, ray.tmax);
  return text;
}

std::vector<Reader> readers() {
  const std::vector<oracle::Mesh> meshes{oracle::icosphere(2)};
  const auto bvh = build::build(oracle::views(meshes), {.threads = 1});
  REQUIRE(bvh.has_value());
  const std::string bytes = text_of(bvh->buffer.bytes());
  // Three parts, so that several threads read.
  std::string large;
  for (std::uint32_t i = 0; large.size() < (std::size_t{40} << 20); ++i) large.append(bytes, i % 4096);
  const test::TempFolder folder;
  REQUIRE(tools::write_rays(folder / "a.rays", true, std::vector<Ray>(100)).has_value());
  return {
      {"map_file", bytes, [](const fs::path& path) { return text_of(build::map_file(path)); }},
      {"open_scene", bytes,
       [](const fs::path& path) -> build::Result<std::string> {
         const auto scene = open_scene(path.string());
         if (!scene) return tl::unexpected(scene.error());
         return text_of(scene->view().bytes);
       }},
      {"read_file", bytes, [](const fs::path& path) { return text_of(build::read_file(path)); }},
      {"read_input", bytes, [](const fs::path& path) { return text_of(tools::read_input(path)); }},
      {"read_input, 4 threads", large, [](const fs::path& path) { return text_of(tools::read_input(path, 4)); }},
      {"RayStream", test::read_file(folder / "a.rays"), stream_rays},
  };
}

bool same(const build::Result<std::string>& read, const Reader& reader) { return read && *read == reader.content; }

std::size_t open_descriptors() {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator{}));
}

bool is_mapped(const fs::path& path) {
  return test::read_file("/proc/self/maps").find(path.string()) != std::string::npos;
}

/// One line of the code kIo with the path, once, and the reason.
void check_error(const build::Error& error, const fs::path& path, const std::string& reason) {
  INFO(error.message);
  CHECK(error.code == build::ErrorCode::kIo);
  CHECK(error.message.find('\n') == std::string::npos);
  CHECK_THAT(error.message, Catch::Contains(reason));
  const std::size_t found = error.message.find(path.string());
  REQUIRE(found != std::string::npos);
  CHECK(error.message.find(path.string(), found + 1) == std::string::npos);
}

}  // namespace

TEST_CASE("each call of the system that fails while a file is read gives one error with the path and leaks nothing") {
  unsigned faults = 0;
  std::set<std::string> failed;
  for (const Reader& reader : readers()) {
    const test::TempFolder folder;
    const fs::path path = folder.write("a", reader.content);
    REQUIRE(same(reader.read(path), reader));
    const std::size_t descriptors = open_descriptors();
    for (const int error : {EIO, EACCES, EMFILE, ENOMEM})
      for (unsigned at = 1;; ++at) {
        fault.start(at, error);
        const auto result = reader.read(path);
        const std::string name = fault.name.load();
        if (fault.stop() < at) break;
        CAPTURE(reader.name, error, at, name);
        ++faults;
        failed.insert(name);
        REQUIRE_FALSE(result.has_value());
        check_error(result.error(), path, std::generic_category().message(error));
        CHECK(open_descriptors() == descriptors);
        CHECK_FALSE(is_mapped(path));
        CHECK(same(reader.read(path), reader));
      }
  }
  std::printf("reading: %u faults, as many errors\n", faults);
  CHECK(failed == std::set<std::string>{"fstat", "mmap", "open", "pread"});
}

TEST_CASE("a signal that interrupts a call, and short reads, change nothing") {
  unsigned faults = 0;
  oracle::Random random(34);
  for (const Reader& reader : readers()) {
    const test::TempFolder folder;
    const fs::path path = folder.write("a", reader.content);
    const std::size_t descriptors = open_descriptors();
    const auto most = static_cast<unsigned>(1 + reader.content.size() / 8);
    for (unsigned at = 1;; ++at) {
      fault.start(at, EINTR, 1 + random.below(most));
      const auto result = reader.read(path);
      const std::string name = fault.name.load();
      if (fault.stop() < at) break;
      if (name != "open" && name != "pread") continue;  // The system never interrupts the others.
      CAPTURE(reader.name, at, name);
      ++faults;
      CHECK(same(result, reader));
      CHECK(open_descriptors() == descriptors);
    }
  }
  std::printf("reading: %u interrupted calls between short reads, each survived\n", faults);
}

TEST_CASE("a file that ends while it is read is an error with the path") {
  unsigned faults = 0;
  for (const Reader& reader : readers()) {
    const test::TempFolder folder;
    const fs::path path = folder.write("a", reader.content);
    for (unsigned at = 1;; ++at) {
      fault.start(at, 0);
      const auto result = reader.read(path);
      const std::string name = fault.name.load();
      if (fault.stop() < at) break;
      if (name != "pread") continue;
      CAPTURE(reader.name, at);
      ++faults;
      REQUIRE_FALSE(result.has_value());
      check_error(result.error(), path, "another program shortened it");
    }
  }
  std::printf("reading: %u early ends of files, as many errors\n", faults);
  CHECK(faults > 0);
}
