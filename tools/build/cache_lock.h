#pragma once
/// Who uses a cache folder now. Locks end with their process, however that ends.
///
/// FOLDER/.lock is locked shared for each lookup and exclusively while entries are removed. FOLDER/.use-PID-N is locked
/// by the process PID while it has the cache open. An entry that was used later than such a file was made may be in
/// use.

#include <hiprt_build/error.h>

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>

namespace hiprt::tools {

/// A file that is locked until the end of this object.
class LockedFile {
 public:
  LockedFile() = default;
  LockedFile(LockedFile&& other) noexcept;
  LockedFile& operator=(LockedFile&& other) noexcept;
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;
  ~LockedFile();

  /// Opens FOLDER/.lock and waits for the lock, at most a minute. In a folder that cannot be written, the result has no
  /// lock: nobody can remove entries there.
  /// @return kIo: another process had the lock all the time.
  static build::Result<LockedFile> of_folder(const std::filesystem::path& folder, bool exclusive);
  /// Makes this process's file FOLDER/.use-PID-N. No lock if the folder cannot be written.
  static LockedFile of_use(const std::filesystem::path& folder);

  explicit operator bool() const { return descriptor_ >= 0; }

 private:
  explicit LockedFile(int descriptor, std::filesystem::path removed = {});
  void reset();

  int descriptor_ = -1;
  std::filesystem::path removed_{};  ///< Removed at the end; empty: it stays.
};

/// When a file was written last, in nanoseconds; the clock of its file system.
std::int64_t write_time(const struct stat& status);

/// Removes the temporary files of dead processes if @p group is a folder of entries.
void remove_dead_temporaries(const std::filesystem::path& group);

/// The time at which the oldest process that uses the folder opened it; nothing: nobody uses it. Removes the files of
/// dead processes.
std::optional<std::int64_t> oldest_use(const std::filesystem::path& folder);

}  // namespace hiprt::tools
