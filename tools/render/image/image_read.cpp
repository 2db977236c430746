#include <tools/render/image/image_read.h>

#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/render/image/exr_attributes.h>

#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledInputPart.h>
#if __has_include(<OpenEXR/ImfContextInit.h>)  // OpenEXR 3.3 and newer.
#include <OpenEXR/ImfContextInit.h>
#endif

#include <algorithm>
#include <array>
#include <cstring>

namespace hiprt::tools {
namespace {

constexpr std::array<const char*, 3> kColorChannels{"R", "G", "B"};

/// Bytes that stay in memory.
class MemoryInput : public Imf::IStream {
 public:
  MemoryInput(const char* name, std::span<const std::byte> bytes) : Imf::IStream(name), bytes_(bytes) {}

  bool read(char data[], int count) override {
    const auto size = static_cast<std::uint64_t>(std::max(count, 0));
    if (position_ > bytes_.size() || size > bytes_.size() - position_) {
      ends_early_ = true;
      throw Iex::InputExc(kEndsEarly);
    }
    std::memcpy(data, bytes_.data() + position_, static_cast<std::size_t>(size));
    position_ += size;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }
#if __has_include(<OpenEXR/ImfContextInit.h>)
  /// OpenEXR then allocates nothing for an attribute that is larger than the file.
  std::int64_t size() override { return static_cast<std::int64_t>(bytes_.size()); }
#endif

  static constexpr const char* kEndsEarly = "the file ends too early";
  /// Whether a read went beyond the end. OpenEXR 3.4 returns such a picture without its last rows.
  bool ends_early() const { return ends_early_; }

 private:
  std::span<const std::byte> bytes_;
  bool ends_early_ = false;
  std::uint64_t position_ = 0;
};

tl::unexpected<build::Error> refused(const std::string& name, const std::string& why) {
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, name + ": " + why});
}

/// OpenEXR's message on one line.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

/// The first four bytes of every OpenEXR file.
bool is_exr(std::span<const std::byte> bytes) {
  constexpr std::array<unsigned char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};
  return bytes.size() >= kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0;
}

/// Width and height. The corners may be anything that 32 bits hold.
std::pair<std::uint64_t, std::uint64_t> size_of(const Imf::Header& header) {
  const auto& window = header.dataWindow();
  const auto extent = [](std::int64_t low, std::int64_t high) {
    return high < low ? std::uint64_t{0} : static_cast<std::uint64_t>(high - low + 1);
  };
  return {extent(window.min.x, window.max.x), extent(window.min.y, window.max.y)};
}

build::Result<void> check_size(const std::string& name, const Imf::Header& header) {
  const auto [width, height] = size_of(header);
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width == 0 || height == 0) return refused(name, "damaged: " + size);
  if (width > kMaxSide || height > kMaxSide || width * height > kMaxPixels)
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, name + ": " + size + ", the limits are " +
                                                                        std::to_string(kMaxSide) + " per side and " +
                                                                        std::to_string(kMaxPixels) + " in all"});
  return {};
}

build::Result<void> check_channels(const std::string& name, const Imf::ChannelList& channels) {
  for (const char* color : kColorChannels) {
    const Imf::Channel* channel = channels.findChannel(color);
    const std::string named = std::string("channel ") + color;
    if (channel == nullptr) return refused(name, "lacks " + named);
    if (channel->type != Imf::HALF && channel->type != Imf::FLOAT) return refused(name, named + " is of integers");
    if (channel->xSampling != 1 || channel->ySampling != 1) return refused(name, named + " is subsampled");
  }
  return {};
}

/// Tiles are decoded as a whole: one is bounded as the picture is.
build::Result<void> check_tiles(const std::string& name, const Imf::Header& header) {
  const Imf::TileDescription& tile = header.tileDescription();
  if (tile.xSize <= kMaxSide && tile.ySize <= kMaxSide) return {};
  return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, name + ": tiles of " + std::to_string(tile.xSize) +
                                                                      " x " + std::to_string(tile.ySize) +
                                                                      " pixels, the limit is " +
                                                                      std::to_string(kMaxSide) + " per side"});
}

/// Bytes of the channels' values at a pixel.
std::uint64_t bytes_per_pixel(const Imf::ChannelList& channels) {
  std::uint64_t bytes = 0;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
    bytes += channel.channel().type == Imf::HALF ? 2 : 4;
  return bytes;
}

/// Can a file of this size have so many pixels, of the picture and of a tile?
build::Result<void> check_file_size(const std::string& name, const Imf::Header& header, std::uint64_t file_bytes) {
  const auto [width, height] = size_of(header);
  std::uint64_t pixels = width * height;
  if (header.hasTileDescription()) {
    const Imf::TileDescription& tile = header.tileDescription();
    pixels = std::max(pixels, std::uint64_t{tile.xSize} * tile.ySize);
  }
  const std::uint64_t expansion = header.compression() == Imf::NO_COMPRESSION ? 1 : kMostExrExpansion;
  const std::uint64_t least = pixels * bytes_per_pixel(header.channels()) / expansion;
  if (least <= file_bytes) return {};
  return refused(name, "truncated: " + std::to_string(width) + " x " + std::to_string(height) + " pixels take " +
                           std::to_string(least) + " bytes or more, but the file has " + std::to_string(file_bytes));
}

/// What must hold before memory for pixels is asked for.
build::Result<void> check_header(const std::string& name, const Imf::Header& header, std::uint64_t file_bytes) {
  if (header.hasType() && header.type() != Imf::SCANLINEIMAGE && header.type() != Imf::TILEDIMAGE)
    return refused(name, "of type '" + one_line(header.type()) + "', not scan lines or tiles");
  if (auto size = check_size(name, header); !size) return size;
  if (auto channels = check_channels(name, header.channels()); !channels) return channels;
  if (header.hasTileDescription())
    if (auto tiles = check_tiles(name, header); !tiles) return tiles;
  return check_file_size(name, header, file_bytes);
}

/// Opens a file without repairing it, and without OpenEXR's own messages on standard error.
class QuietFile : public Imf::MultiPartInputFile {
 public:
#if __has_include(<OpenEXR/ImfContextInit.h>)
  explicit QuietFile(Imf::IStream& stream)
      : MultiPartInputFile(stream.fileName(),
                           Imf::ContextInitializer()
                               .setInputStream(&stream)
                               .setErrorHandler([](exr_const_context_t, exr_result_t, const char*){})
                               .disableChunkReconstruction(true),
                           /*numThreads=*/0) {}
#else
  explicit QuietFile(Imf::IStream& stream)
      : MultiPartInputFile(stream, /*numThreads=*/0, /*reconstructChunkOffsetTable=*/false) {}
#endif
};

/// Throws what OpenEXR throws.
build::Result<ColorImage> decode(const std::string& name, Imf::IStream& stream, std::uint64_t file_bytes) {
  QuietFile file(stream);
  if (file.parts() < 1) return refused(name, "has no picture");
  const Imf::Header& header = file.header(0);
  if (auto checked = check_header(name, header, file_bytes); !checked) return tl::unexpected(checked.error());
  const auto [width, height] = size_of(header);
  ColorImage image(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
  Imf::FrameBuffer frame;
  for (std::size_t channel = 0; channel < kColorChannels.size(); ++channel)
    frame.insert(kColorChannels[channel],
                 Imf::Slice::Make(Imf::FLOAT, reinterpret_cast<char*>(image.colors.data()) + channel * sizeof(float),
                                  header.dataWindow(), sizeof(Vec3), sizeof(Vec3) * image.width));
  if (header.hasType() && header.type() == Imf::TILEDIMAGE) {
    Imf::TiledInputPart part(file, 0);
    part.setFrameBuffer(frame);
    part.readTiles(0, part.numXTiles() - 1, 0, part.numYTiles() - 1);
  } else {
    Imf::InputPart part(file, 0);
    part.setFrameBuffer(frame);
    part.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
  }
  return image;
}

}  // namespace

build::Result<ColorImage> decode_exr_colors(std::span<const std::byte> bytes, const std::string& name) try {
  if (!is_exr(bytes)) return refused(name, "not an OpenEXR file");
  if (const std::string fault = fault_of_exr_attributes(bytes); !fault.empty())
    return refused(name, "damaged: " + fault);
  MemoryInput stream(name.c_str(), bytes);
  build::Result<ColorImage> image = decode(name, stream, bytes.size());
  if (image && stream.ends_early()) return refused(name, std::string("damaged: ") + MemoryInput::kEndsEarly);
  return image;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(name, "to read it", failure));
} catch (const std::exception& error) {
  return refused(name, "damaged: " + one_line(error.what()));
}

build::Result<ColorImage> read_exr_colors(const std::filesystem::path& path) {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  return decode_exr_colors(file->bytes(), path.native());
}

}  // namespace hiprt::tools
