#pragma once
/// The temporary file that a write renames to its target. Removes what killed processes left. POSIX. Internal.

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <utility>

namespace hiprt::build::file_detail {

/// @return call(), again while a signal interrupts it.
template <class Call> auto uninterrupted(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Closes a file descriptor when it goes out of scope; errno stays.
class File {
 public:
  explicit File(int descriptor = -1) : descriptor_(descriptor) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { reset(-1); }

  int get() const { return descriptor_; }
  void reset(int descriptor) {
    const int error = errno;
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = descriptor;
    errno = error;
  }

 private:
  int descriptor_;
};

inline constexpr const char* kTemporaryPrefix = ".hiprt-";
inline constexpr const char* kTemporaryEnd = ".tmp";

/// @return whether this process has the lock now. It ends with the process, however that ends.
inline bool lock(int descriptor) {
  return uninterrupted([&] { return ::flock(descriptor, LOCK_EX | LOCK_NB); }) == 0;
}

/// Whether the descriptor's file still has a name.
inline bool has_name(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && status.st_nlink != 0;
}

/// A new file with the permissions that the umask gives. Its writer has it locked. Removed at the end unless keep() is
/// called; errno stays.
class TemporaryFile {
 public:
  /// Without a file, errno has the reason.
  explicit TemporaryFile(const std::filesystem::path& folder) {
    static std::atomic<std::uint32_t> counter{0};
    constexpr int kAttempts = 100;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      path_ =
          folder / (kTemporaryPrefix + std::to_string(::getpid()) + "-" + std::to_string(counter++) + kTemporaryEnd);
      file_.reset(uninterrupted([&] { return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666); }));
      if (file_.get() < 0 && errno == EEXIST) continue;
      if (file_.get() < 0) return;
      // Before the lock another process may take the file for one of the dead. Some file systems have no locks.
      if ((lock(file_.get()) || errno != EWOULDBLOCK) && has_name(file_.get())) return;
      file_.reset(-1);
      errno = EEXIST;
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    const int error = errno;
    if (file_.get() >= 0 && !kept_) ::unlink(path_.c_str());
    errno = error;
  }

  explicit operator bool() const { return file_.get() >= 0; }
  int get() const { return file_.get(); }
  const std::filesystem::path& path() const { return path_; }
  /// The file has its final name.
  void keep() { kept_ = true; }

 private:
  std::filesystem::path path_;
  File file_;
  bool kept_ = false;
};

/// Removes @p path if its writer is dead: nobody has it locked, and it is a regular file of this name.
inline void remove_if_dead(const std::filesystem::path& path) {
  // For writing: NFS gives exclusive locks to writers only.
  const File file(uninterrupted([&] { return ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW); }));
  struct stat opened {
  }, named{};
  if (file.get() < 0 || ::fstat(file.get(), &opened) != 0 || !S_ISREG(opened.st_mode) || !lock(file.get())) return;
  if (::lstat(path.c_str(), &named) != 0 || named.st_ino != opened.st_ino || named.st_dev != opened.st_dev) return;
  ::unlink(path.c_str());
}

inline void remove_dead(const std::filesystem::path& folder) {
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(kTemporaryPrefix) && name.ends_with(kTemporaryEnd)) remove_if_dead(entry->path());
  }
}

/// Removes temporary files of dead processes when this process first writes into the folder.
inline void remove_dead_once(const std::filesystem::path& folder) {
  static std::mutex mutex;
  static std::set<std::filesystem::path> seen;
  const std::lock_guard guard(mutex);
  if (seen.insert(std::filesystem::absolute(folder)).second) remove_dead(folder);
}

}  // namespace hiprt::build::file_detail
