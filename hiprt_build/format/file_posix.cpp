#include <hiprt_build/file.h>
#include <hiprt_build/format/file_target.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/format/temporary_file.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace hiprt::build {

namespace {

using namespace file_detail;

tl::unexpected<Error> system_error(std::string_view action, const std::filesystem::path& path) {
  return io_error(action, path, std::generic_category().message(errno));
}

/// Whether an existing file may be replaced.
Result<void> permitted(const std::filesystem::path& path) {
  if (::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) != 0) return system_error("write", path);
  return {};
}

bool write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    // Linux writes at most 2^31 - 4096 bytes in one call.
    const ssize_t written = uninterrupted(
        [&] { return ::write(descriptor, bytes.data(), std::min<std::size_t>(bytes.size(), std::size_t{1} << 30)); });
    if (written == 0) errno = ENOSPC;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

/// Makes the rename itself durable. Some file systems refuse to flush a folder; the file is complete nevertheless.
void flush_folder(const std::filesystem::path& folder) {
  const File directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) static_cast<void>(::fsync(directory.get()));
}

/// Fills the temporary file and renames it.
/// @return what failed, or nullptr; errno has the reason.
const char* fill_and_rename(const TemporaryFile& file, const std::filesystem::path& target,
                            std::span<const std::byte> bytes) {
  struct stat replaced {};
  if (!write_all(file.get(), bytes)) return "write";
  if (::stat(target.c_str(), &replaced) == 0 &&
      uninterrupted([&] { return ::fchmod(file.get(), replaced.st_mode & 0777); }) != 0)
    return "keep the permissions of";
  if (uninterrupted([&] { return ::fsync(file.get()); }) != 0) return "flush";
  // Renamed before it is closed: a file that nobody has locked counts as one of the dead. fsync() has reported the
  // errors of writing.
  if (::rename(file.path().c_str(), target.c_str()) != 0) return "replace";
  return nullptr;
}

File open_to_read(const std::filesystem::path& path) {
  // O_NONBLOCK: opening a FIFO must not wait for a writer.
  return File(uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); }));
}

/// @param action for messages.
/// @return the status of a regular file that is not empty.
Result<struct stat> status_of_regular(const File& file, std::string_view action, const std::filesystem::path& path) {
  struct stat status {};
  if (file.get() < 0) return system_error("open", path);
  if (::fstat(file.get(), &status) != 0) return system_error("examine", path);
  if (S_ISDIR(status.st_mode)) return io_error(action, path, "it is a directory");
  if (!S_ISREG(status.st_mode)) return io_error(action, path, "it is not a regular file");
  if (status.st_size == 0) return io_error(action, path, "it is empty");
  return status;
}

Result<Buffer> map_it(const std::filesystem::path& path) {
  const File file = open_to_read(path);
  const auto status = status_of_regular(file, "map", path);
  if (!status) return tl::unexpected(status.error());
  const std::size_t size = static_cast<std::size_t>(status->st_size);
  void* data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.get(), 0);
  if (data == MAP_FAILED) return system_error("map", path);
  return Buffer(static_cast<std::byte*>(data), size,
                [](std::byte* start, std::size_t bytes) { ::munmap(start, bytes); });
}

/// When the content changed last, in seconds and nanoseconds.
std::pair<std::int64_t, std::int64_t> modified(const struct stat& status) {
#ifdef __APPLE__
  return {status.st_mtimespec.tv_sec, status.st_mtimespec.tv_nsec};
#else
  return {status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
#endif
}

/// One call of the loop reads so much: few calls, and enough of them for many threads.
constexpr std::size_t kPart = std::size_t{16} << 20;

/// Reads the parts of a file, each once, on any thread.
class Parts {
 public:
  Parts(int descriptor, std::span<std::byte> bytes) : descriptor_(descriptor), bytes_(bytes), end_(bytes.size()) {}

  std::size_t count() const { return (bytes_.size() + kPart - 1) / kPart; }

  void read(std::size_t part) {
    std::size_t at = part * kPart;
    const std::size_t stop = std::min(bytes_.size(), at + kPart);
    while (at < stop) {
      const ssize_t count =
          uninterrupted([&] { return ::pread(descriptor_, bytes_.data() + at, stop - at, static_cast<off_t>(at)); });
      if (count < 0) fault_ = errno;
      if (count == 0) lower_end(at);
      if (count <= 0) return;
      at += static_cast<std::size_t>(count);
    }
  }

  /// The reason of a read that failed; 0: none has.
  int fault() const { return fault_; }
  /// The first byte that the file did not have, or its size.
  std::size_t end() const { return end_; }

 private:
  void lower_end(std::size_t at) {
    std::size_t old = end_;
    while (at < old && !end_.compare_exchange_weak(old, at)) {
    }
  }

  int descriptor_;
  std::span<std::byte> bytes_;
  std::atomic<std::size_t> end_;
  std::atomic<int> fault_ = 0;
};

Result<Buffer> read_it(const std::filesystem::path& path, const ParallelLoop& loop) {
  const File file = open_to_read(path);
  const auto before = status_of_regular(file, "read", path);
  if (!before) return tl::unexpected(before.error());
  Buffer buffer = Buffer::uninitialized(static_cast<std::size_t>(before->st_size));
  Parts parts(file.get(), buffer.bytes());
  run_loop(loop, parts.count(), [&](std::size_t part) { parts.read(part); });
  if (parts.fault() != 0) return io_error("read", path, std::generic_category().message(parts.fault()));
  if (parts.end() < buffer.size())
    return io_error("read", path,
                    "it had " + std::to_string(buffer.size()) + " bytes, but ended at byte " +
                        std::to_string(parts.end()) + ": another program shortened it");
  struct stat after {};
  if (::fstat(file.get(), &after) != 0) return system_error("examine", path);
  if (after.st_size != before->st_size || modified(after) != modified(*before))
    return io_error("read", path, "another program changed it at the same time; try again when that has ended");
  return buffer;
}

Result<void> check_target(const std::filesystem::path& path) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  const auto folder = existing_folder_of(path, *target);
  if (!folder) return tl::unexpected(folder.error());
  if (::faccessat(AT_FDCWD, folder->c_str(), W_OK | X_OK, AT_EACCESS) != 0)
    return system_error("create a temporary file beside", path);
  remove_dead_once(*folder);
  return {};
}

Result<void> replace_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  const std::filesystem::path folder = folder_of(*target);
  remove_dead_once(folder);
  TemporaryFile file(folder);
  if (!file) return system_error("create a temporary file beside", path);
  if (const char* failed = fill_and_rename(file, *target, bytes)) return system_error(failed, path);
  file.keep();
  flush_folder(folder);
  return {};
}

}  // namespace

Result<Buffer> map_file(const std::filesystem::path& path) {
  return or_out_of_memory("to map the file", [&] { return map_it(path); });
}

Result<Buffer> read_file(const std::filesystem::path& path, const ParallelLoop& loop) {
  return or_out_of_memory("to read the file", [&] { return read_it(path, loop); });
}

Result<void> check_writable(const std::filesystem::path& path) {
  return or_out_of_memory("to check the path", [&] { return check_target(path); });
}

Result<void> write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  return or_out_of_memory("to write the file", [&] { return replace_file(path, bytes); });
}

}  // namespace hiprt::build
