/// Decodes JPEG with the decoder in tinygltf (stb_image). It accepts truncated files, and allocates memory before it
/// returns the size. Therefore completeness and size are read from the markers first (ITU-T T.81, annex B).

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/scene_io/surface/picture.h>

#include <tiny_gltf.h>

#include <cstring>
#include <limits>
#include <optional>
#include <string>

namespace hiprt::tools {
namespace {

struct JpegSize {
  std::uint32_t width, height;
};

/// Walks a file's markers.
class JpegMarkers {
 public:
  explicit JpegMarkers(std::span<const std::byte> file) : file_(file) {}

  /// @return the frame's size, if the markers lead from the frame over its scans to the end of the image.
  build::Result<JpegSize> size() {
    std::optional<JpegSize> size;
    at_ = 2;  // After the start of the image.
    while (at_ + 2 <= file_.size()) {
      if (byte(at_) != 0xff) return damaged("no marker at byte " + std::to_string(at_));
      const unsigned marker = byte(at_ + 1);
      if (marker == 0xff) {  // A fill byte.
        ++at_;
        continue;
      }
      at_ += 2;
      if (marker == kEnd && size) return *size;
      if (marker == kEnd) return damaged("it ends without a picture");
      if (stands_alone(marker)) continue;
      const std::size_t length = at_ + 2 <= file_.size() ? word(at_) : 0;
      if (length < 2 || length > file_.size() - at_) return truncated();
      if (is_frame(marker)) {
        if (length < 8) return damaged("a frame header of " + std::to_string(length) + " bytes");
        size = JpegSize{word(at_ + 5), word(at_ + 3)};
      }
      at_ += length;
      if (marker == kScan) skip_scan();
    }
    return truncated();
  }

 private:
  static constexpr unsigned kEnd = 0xd9, kScan = 0xda;

  static bool is_restart(unsigned marker) { return marker >= 0xd0 && marker <= 0xd7; }
  static bool stands_alone(unsigned marker) { return marker == 0x01 || marker == 0xd8 || is_restart(marker); }
  /// Start of frame; between them are tables of other kinds.
  static bool is_frame(unsigned marker) {
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
  }
  static tl::unexpected<build::Error> damaged(const std::string& what) {
    return invalid_input("damaged JPEG: " + what);
  }
  tl::unexpected<build::Error> truncated() const {
    return damaged("truncated after " + std::to_string(file_.size()) + " bytes");
  }

  unsigned byte(std::size_t i) const { return std::to_integer<unsigned>(file_[i]); }
  std::uint32_t word(std::size_t i) const { return byte(i) << 8 | byte(i + 1); }
  /// Skips to the marker after coded data, which has 0xff only before 0 and in restart markers.
  void skip_scan() {
    while (at_ + 2 <= file_.size() && (byte(at_) != 0xff || byte(at_ + 1) == 0 || is_restart(byte(at_ + 1)))) ++at_;
  }

  std::span<const std::byte> file_;
  std::size_t at_ = 0;
};

}  // namespace

build::Result<Texture> decode_jpeg(std::span<const std::byte> bytes, std::uint64_t most_texels) {
  const auto size = JpegMarkers(bytes).size();
  if (!size) return tl::unexpected(size.error());
  if (auto checked = check_picture_size(size->width, size->height, most_texels); !checked)
    return tl::unexpected(checked.error());
  // One component, in blocks of 8 x 8 texels that take a bit each.
  constexpr std::uint64_t kBlockTexels = 64;
  if (auto checked = check_file_size(size->width, size->height, 1, kBlockTexels, bytes.size()); !checked)
    return tl::unexpected(checked.error());
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge,
                                       "JPEG of " + std::to_string(bytes.size()) + " bytes, the limit is 2147483647"});
  // stb_image calls a picture damaged that memory does not hold: coefficients, planes and texels of 4 components.
  constexpr std::size_t kDecoderBytes = 16;
  require_memory(kDecoderBytes * size->width * size->height);
  tinygltf::Image image;
  std::string ignored;
  if (!tinygltf::LoadImageData(&image, 0, &ignored, &ignored, static_cast<int>(size->width),
                               static_cast<int>(size->height), reinterpret_cast<const unsigned char*>(bytes.data()),
                               static_cast<int>(bytes.size()), nullptr))
    return invalid_input("damaged JPEG, or of a kind that is not read (baseline and progressive are)");
  Texture result{{}, size->width, size->height, {}};
  result.texels.resize(std::size_t{result.width} * result.height);
  if (image.image.size() != result.texels.size() * sizeof(std::uint32_t))
    return invalid_input("damaged JPEG: " + std::to_string(image.image.size()) + " bytes of texels");
  std::memcpy(result.texels.data(), image.image.data(), image.image.size());
  return result;
}

}  // namespace hiprt::tools
