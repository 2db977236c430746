#pragma once
/// Ray files and files of results that are larger than memory.
///
/// The count of a ray file or path file has 32 bits. The largest one, 4294967295, also stands for every larger count:
/// then the size of the file tells it.

#include <hiprt_build/error.h>
#include <hiprt_device/ray.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// A file descriptor, closed by its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();

  int number() const { return number_; }

 private:
  int number_ = -1;
};

/// A ray file, read in parts.
class RayStream {
 public:
  /// @return kIo if it cannot be opened; kInvalidInput if its size does not fit its count or its flag is not 0 or 1.
  static build::Result<RayStream> open(const std::filesystem::path& path);

  std::uint64_t count() const { return count_; }
  bool any_hit() const { return any_hit_; }
  /// Size in bytes, and nanoseconds of the last change since 1970.
  std::uint64_t size() const { return size_; }
  std::int64_t changed() const { return changed_; }

  /// Reads rays [first, first + count). May be called from any thread.
  /// @return kIo, also if another program shortened the file.
  build::Result<std::vector<Ray>> read(std::uint64_t first, std::size_t count) const;

 private:
  RayStream() = default;

  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t count_ = 0, size_ = 0;
  std::int64_t changed_ = 0;
  bool any_hit_ = false;
};

/// A file whose parts are written in any order, below another name (PATH.part) until publish().
class PartialOutput {
 public:
  /// @param size of the whole file. @param goes_on whether the file must be there, from an earlier run.
  /// @return kIo; kInvalidInput if the file of an earlier run is missing or of another size.
  static build::Result<PartialOutput> open(const std::filesystem::path& path, std::uint64_t size, bool goes_on);

  PartialOutput(PartialOutput&&) noexcept = default;
  PartialOutput& operator=(PartialOutput&&) noexcept = default;

  build::Result<void> write(std::uint64_t offset, std::span<const std::byte> bytes) const;
  /// Waits until what was written is on the disk.
  build::Result<void> flush() const;
  /// Gives the file its name. Call it after flush().
  build::Result<void> publish() const;
  /// Removes the file.
  void remove() const;

 private:
  PartialOutput() = default;

  std::filesystem::path path_, part_;
  Descriptor file_;
};

}  // namespace hiprt::tools
