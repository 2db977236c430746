#pragma once
/// Finished units of a picture in a file, so that an interrupted run can go on.
///
///     "HIPRTPIC"            8 bytes
///     size of the header    8 bytes, little-endian, as all numbers
///     header                JSON: the key, the grid, counts
///     for each tile with steps, in order: its number (4 bytes), its steps (4), the state of its pixels row by row
///     XXH3-128 of all of this (16 bytes)

#include <tools/render/units/picture_state.h>

#include <hiprt_build/error.h>

#include <chrono>
#include <future>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::tools {

/// What the bits of a picture depend on: names and values, e.g. ("spp", "64").
using PictureKey = std::vector<std::pair<std::string, std::string>>;

/// @return the first difference of two keys, e.g. "spp is 32 there and 64 here"; empty if they are equal.
std::string difference(const PictureKey& there, const PictureKey& here);

std::vector<std::byte> encode_checkpoint(const PictureKey& key, const PictureState& state);

/// @param steps, pixel_bytes of the picture, with the size of @p grid. The file's tiles may have another size.
/// @return kInvalidInput if the bytes are damaged, or of another picture: the message says what differs.
build::Result<PictureState> decode_checkpoint(std::span<const std::byte> bytes, const PictureKey& key,
                                              const PictureGrid& grid, std::uint32_t steps, std::size_t pixel_bytes);

/// The file of a picture that is being computed. One thread may use it.
class Checkpoint {
 public:
  /// @param seconds between two writes, at least. It is longer where a write takes more than a twentieth of it.
  Checkpoint(std::string path, PictureKey key, double seconds);

  const std::string& path() const { return path_; }

  /// @return the state of the file, or nothing if there is no file; the errors of decode_checkpoint() and read_input().
  build::Result<std::optional<PictureState>> load(const PictureGrid& grid, std::uint32_t steps,
                                                  std::size_t pixel_bytes) const;
  /// Writes in the background, if it is time.
  /// @return the error of the last write.
  build::Result<void> keep(const PictureState& state);
  /// Writes now.
  build::Result<void> write(const PictureState& state);
  /// Removes the file: the picture is whole.
  void remove();

 private:
  using Clock = std::chrono::steady_clock;

  struct Written {
    build::Result<void> result;
    double seconds;
  };

  static Written write_bytes(const std::string& path, const std::vector<std::byte>& bytes);

  std::string path_;
  PictureKey key_;
  double seconds_;
  Clock::time_point next_;
  std::future<Written> writing_;
};

}  // namespace hiprt::tools
