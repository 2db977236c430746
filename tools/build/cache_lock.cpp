#include <tools/build/cache_lock.h>

#include <tools/base/errors.h>

#include <hiprt_build/format/temporary_file.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

namespace hiprt::tools {
namespace {

constexpr const char* kLock = ".lock";
constexpr const char* kUse = ".use-";

bool lock(int descriptor, int operation) {
  while (::flock(descriptor, operation | LOCK_NB) != 0)
    if (errno != EINTR) return false;
  return true;
}

}  // namespace

LockedFile::LockedFile(int descriptor, std::filesystem::path removed)
    : descriptor_(descriptor), removed_(std::move(removed)) {}

LockedFile::LockedFile(LockedFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), removed_(std::move(other.removed_)) {}

LockedFile& LockedFile::operator=(LockedFile&& other) noexcept {
  if (this == &other) return *this;
  reset();
  descriptor_ = std::exchange(other.descriptor_, -1);
  removed_ = std::move(other.removed_);
  return *this;
}

LockedFile::~LockedFile() { reset(); }

void LockedFile::reset() {
  if (descriptor_ < 0) return;
  if (!removed_.empty()) ::unlink(removed_.c_str());
  ::close(descriptor_);
  descriptor_ = -1;
}

build::Result<LockedFile> LockedFile::of_folder(const std::filesystem::path& folder, bool exclusive) {
  constexpr auto kMostWait = std::chrono::seconds(60);
  const std::filesystem::path path = folder / kLock;
  LockedFile file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (!file) file = LockedFile(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return file;
  const auto end = std::chrono::steady_clock::now() + kMostWait;
  while (!lock(file.descriptor_, exclusive ? LOCK_EX : LOCK_SH)) {
    // Some file systems have no locks.
    if (errno != EWOULDBLOCK) return LockedFile();
    if (std::chrono::steady_clock::now() > end)
      return fail(build::ErrorCode::kIo, path.string() +
                                             ": another process had it locked for a minute: wait until "
                                             "bvhbuild --prune has ended, and try again");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return file;
}

LockedFile LockedFile::of_use(const std::filesystem::path& folder) {
  static std::atomic<unsigned> counter{0};
  const std::filesystem::path path = folder / (kUse + std::to_string(::getpid()) + "-" + std::to_string(counter++));
  // One of a dead process with the same number, perhaps of another machine, counts from now on.
  LockedFile file(::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666), path);
  if (!file) return file;
  ::futimens(file.descriptor_, nullptr);
  lock(file.descriptor_, LOCK_EX);
  return file;
}

std::int64_t write_time(const struct stat& status) {
#ifdef __APPLE__
  return std::int64_t{status.st_mtimespec.tv_sec} * 1'000'000'000 + status.st_mtimespec.tv_nsec;
#else
  return std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
#endif
}

void remove_dead_temporaries(const std::filesystem::path& group) {
  std::error_code error;
  if (group.filename().string().size() == 2 && std::filesystem::is_directory(group, error))
    build::file_detail::remove_dead(group);
}

std::optional<std::int64_t> oldest_use(const std::filesystem::path& folder) {
  std::optional<std::int64_t> oldest;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    if (!path.filename().string().starts_with(kUse)) continue;
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    struct stat status {};
    if (descriptor < 0) continue;
    if (lock(descriptor, LOCK_EX))
      ::unlink(path.c_str());
    else if (::fstat(descriptor, &status) == 0)
      oldest = std::min(oldest.value_or(write_time(status)), write_time(status));
    ::close(descriptor);
  }
  return oldest;
}

}  // namespace hiprt::tools
