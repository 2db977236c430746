#include <hiprt_build/file.h>
#include <hiprt_build/format/file_target.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace hiprt::build {

namespace {

using namespace file_detail;

/// Closes a file descriptor when it goes out of scope.
class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { static_cast<void>(close()); }

  int get() const { return descriptor_; }
  /// @return 0, or -1 with errno set.
  int close() { return descriptor_ < 0 ? 0 : ::close(std::exchange(descriptor_, -1)); }

 private:
  int descriptor_;
};

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
    const ssize_t written =
        ::write(descriptor, bytes.data(), std::min<std::size_t>(bytes.size(), std::size_t{1} << 30));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

int open_to_read(const std::filesystem::path& path) {
  // O_NONBLOCK: opening a FIFO must not wait for a writer.
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
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

/// When the content changed last, in seconds and nanoseconds.
std::pair<std::int64_t, std::int64_t> modified(const struct stat& status) {
#ifdef __APPLE__
  return {status.st_mtimespec.tv_sec, status.st_mtimespec.tv_nsec};
#else
  return {status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
#endif
}

/// @return the bytes read, fewer than @p bytes where the file ends before; nothing, with errno set, after a failure.
std::optional<std::size_t> read_all(int descriptor, std::span<std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    // Linux reads at most 2^31 - 4096 bytes in one call.
    const std::size_t most = std::min(bytes.size() - done, std::size_t{1} << 30);
    const ssize_t count = ::read(descriptor, bytes.data() + done, most);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return std::nullopt;
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

/// Creates a file in @p folder with the permissions that the umask gives.
/// @return its descriptor, or -1 with errno set.
int create_temporary(const std::filesystem::path& folder, std::filesystem::path& name) {
  static std::atomic<std::uint32_t> counter{0};
  constexpr int kAttempts = 100;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    name = folder / (".hiprt-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp");
    const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

/// Makes the rename itself durable. Some file systems refuse to flush a folder; the file is complete nevertheless.
void flush_folder(const std::filesystem::path& folder) {
  const File directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) static_cast<void>(::fsync(directory.get()));
}

/// Fills the temporary file and renames it.
/// @return what failed, or nullptr; errno has the reason.
const char* fill_and_rename(File& file, const std::filesystem::path& temporary, const std::filesystem::path& target,
                            std::span<const std::byte> bytes) {
  struct stat replaced {};
  if (!write_all(file.get(), bytes)) return "write";
  if (::stat(target.c_str(), &replaced) == 0 && ::fchmod(file.get(), replaced.st_mode & 0777) != 0)
    return "keep the permissions of";
  if (::fsync(file.get()) != 0) return "flush";
  if (file.close() != 0) return "close";
  if (::rename(temporary.c_str(), target.c_str()) != 0) return "replace";
  return nullptr;
}

}  // namespace

Result<Buffer> map_file(const std::filesystem::path& path) {
  const File file(open_to_read(path));
  const auto status = status_of_regular(file, "map", path);
  if (!status) return tl::unexpected(status.error());
  const std::size_t size = static_cast<std::size_t>(status->st_size);
  void* data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.get(), 0);
  if (data == MAP_FAILED) return system_error("map", path);
  return Buffer(static_cast<std::byte*>(data), size,
                [](std::byte* start, std::size_t bytes) { ::munmap(start, bytes); });
}

Result<Buffer> read_file(const std::filesystem::path& path) try {
  const File file(open_to_read(path));
  const auto before = status_of_regular(file, "read", path);
  if (!before) return tl::unexpected(before.error());
  Buffer buffer = Buffer::uninitialized(static_cast<std::size_t>(before->st_size));
  const auto count = read_all(file.get(), buffer.bytes());
  if (!count) return system_error("read", path);
  if (*count < buffer.size())
    return io_error("read", path,
                    "it had " + std::to_string(buffer.size()) + " bytes, but ended at byte " + std::to_string(*count) +
                        ": another program shortened it");
  struct stat after {};
  if (::fstat(file.get(), &after) != 0) return system_error("examine", path);
  if (after.st_size != before->st_size || modified(after) != modified(*before))
    return io_error("read", path, "another program changed it at the same time; try again when that has ended");
  return buffer;
} catch (const std::bad_alloc&) {
  return tl::unexpected(
      Error{ErrorCode::kOutOfMemory, "cannot read '" + text_of(path) + "': there is not enough memory for its bytes"});
}

Result<void> check_writable(const std::filesystem::path& path) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  const auto folder = existing_folder_of(path, *target);
  if (!folder) return tl::unexpected(folder.error());
  if (::faccessat(AT_FDCWD, folder->c_str(), W_OK | X_OK, AT_EACCESS) != 0)
    return system_error("create a temporary file beside", path);
  return {};
}

Result<void> write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  const std::filesystem::path folder = folder_of(*target);
  std::filesystem::path temporary;
  File file(create_temporary(folder, temporary));
  if (file.get() < 0) return system_error("create a temporary file beside", path);
  if (const char* failed = fill_and_rename(file, temporary, *target, bytes)) {
    auto error = system_error(failed, path);
    ::unlink(temporary.c_str());
    return error;
  }
  flush_folder(folder);
  return {};
}

}  // namespace hiprt::build
