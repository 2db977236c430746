/// The raw mesh format: u32 vertex count, u32 triangle count, float32 positions, u32 indices; little-endian, maybe
/// compressed with zstd.

#include <tools/base/interrupt.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are copied as they are");

constexpr std::size_t kHeaderBytes = 8;
constexpr std::uint64_t kRecordBytes = 12;  ///< Of a position and of a triangle.
static_assert(sizeof(build::Position) == kRecordBytes && sizeof(build::Triangle) == kRecordBytes);

/// Bytes in order, from memory.
class PlainSource {
 public:
  explicit PlainSource(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// Fills as much of @p out as there is. @return the bytes written.
  build::Result<std::size_t> read(std::span<std::byte> out) {
    const std::size_t size = std::min(out.size(), bytes_.size());
    if (size != 0) std::memcpy(out.data(), bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return size;
  }

 private:
  std::span<const std::byte> bytes_;
};

/// Bytes in order, out of one or more zstd frames.
class ZstdSource {
 public:
  explicit ZstdSource(std::span<const std::byte> bytes)
      : stream_(ZSTD_createDCtx(), &ZSTD_freeDCtx), input_{bytes.data(), bytes.size(), 0} {
    if (!stream_) throw std::bad_alloc();
  }

  /// Fills @p out. @return the bytes written: fewer than its size only after the last frame.
  build::Result<std::size_t> read(std::span<std::byte> out) {
    ZSTD_outBuffer output{out.data(), out.size(), 0};
    while (output.pos < output.size) {
      const std::size_t before = output.pos;
      const bool ended = input_.pos == input_.size;
      if (ended && in_frame_ == 0) break;
      in_frame_ = ZSTD_decompressStream(stream_.get(), &output, &input_);
      if (ZSTD_isError(in_frame_) != 0)
        return invalid_input("zstd data is damaged near byte " + std::to_string(input_.pos) + ": " +
                             ZSTD_getErrorName(in_frame_));
      if (ended && in_frame_ != 0 && output.pos == before)
        return invalid_input("truncated: the file ends at byte " + std::to_string(input_.size) +
                             ", inside of a zstd frame");
    }
    return output.pos;
  }

 private:
  std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> stream_;
  ZSTD_inBuffer input_;
  std::size_t in_frame_ = 0;  ///< 0 between frames.
};

/// Reads @p count records, growing the array only as data arrives: a wrong count cannot ask for memory.
template <class Record, class Source>
build::Result<void> read_records(Source& source, std::vector<Record>& records, std::uint32_t count, const char* what) {
  constexpr std::size_t kMostPerStep = std::size_t{1} << 20;
  while (records.size() < count) {
    if (interrupted()) return cancelled();
    const std::size_t first = records.size();
    const std::size_t step = std::min<std::size_t>(kMostPerStep, count - first);
    if (records.capacity() < first + step) records.reserve(std::min<std::size_t>(count, 2 * (first + step)));
    records.resize(first + step);
    const auto got = source.read(std::as_writable_bytes(std::span(records).subspan(first)));
    if (!got) return tl::unexpected(got.error());
    if (*got != step * sizeof(Record))
      return invalid_input("truncated: the header says " + std::to_string(count) + " " + what +
                           ", but the data ends in number " + std::to_string(first + *got / sizeof(Record)));
  }
  return {};
}

template <class Source> build::Result<Mesh> read_mesh(Source source) {
  std::array<std::uint32_t, 2> counts{};
  const auto got = source.read(std::as_writable_bytes(std::span(counts)));
  if (!got) return tl::unexpected(got.error());
  if (*got != kHeaderBytes)
    return invalid_input("truncated: the header takes 8 bytes, there are " + std::to_string(*got));
  Mesh mesh;
  if (auto done = read_records(source, mesh.positions, counts[0], "vertices"); !done)
    return tl::unexpected(done.error());
  if (auto done = read_records(source, mesh.triangles, counts[1], "triangles"); !done)
    return tl::unexpected(done.error());
  std::array<std::byte, 1> extra{};
  const auto behind = source.read(extra);
  if (!behind) return tl::unexpected(behind.error());
  if (*behind != 0) return invalid_input("there is data behind the " + std::to_string(counts[1]) + " triangles");
  return mesh;
}

}  // namespace

build::Result<Mesh> read_raw_mesh(std::span<const std::byte> bytes) {
  constexpr std::array<unsigned char, 4> kZstdMagic{0x28, 0xb5, 0x2f, 0xfd};
  if (bytes.size() >= kZstdMagic.size() && std::memcmp(bytes.data(), kZstdMagic.data(), kZstdMagic.size()) == 0)
    return read_mesh(ZstdSource(bytes));
  std::array<std::uint32_t, 2> counts{};
  if (bytes.size() >= kHeaderBytes) {
    std::memcpy(counts.data(), bytes.data(), kHeaderBytes);
    const std::uint64_t expected = kHeaderBytes + kRecordBytes * (std::uint64_t{counts[0]} + counts[1]);
    if (expected != bytes.size())
      return invalid_input("the header says " + std::to_string(counts[0]) + " vertices and " +
                           std::to_string(counts[1]) + " triangles, which takes " + std::to_string(expected) +
                           " bytes, but the file has " + std::to_string(bytes.size()));
  }
  return read_mesh(PlainSource(bytes));
}

}  // namespace hiprt::tools
