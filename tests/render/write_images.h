#pragma once
/// OpenEXR files of all kinds, written by OpenEXR itself.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <half.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace hiprt::test {

/// A value that halves and floats have, and other in every channel of every pixel of a small picture.
inline float exr_value(unsigned channel, std::uint32_t x, std::uint32_t y) {
  return 0.25f * static_cast<float>(channel) + static_cast<float>(x) - 8.0f * static_cast<float>(y);
}

/// The properties of a file.
struct ExrKind {
  std::uint32_t width = 13, height = 21;
  int left = 0, top = 0;  ///< Of the data window.
  Imf::PixelType type = Imf::FLOAT;
  Imf::Compression compression = Imf::ZIP_COMPRESSION;
  Imf::LineOrder order = Imf::INCREASING_Y;
  std::vector<std::string> channels{"R", "G", "B"};
  int sampling = 1;
  Imf::TileDescription tiles{};  ///< Of tiled files.
};

/// A header, and pixels of exr_value() by the numbers of the channels.
class ExrContent {
 public:
  explicit ExrContent(const ExrKind& kind)
      : header_(Imf::Header(Imath::Box2i({-100, -100}, {99, 99}), window(kind))), width_(kind.width) {
    header_.compression() = kind.compression;
    header_.lineOrder() = kind.order;
    for (unsigned channel = 0; channel < kind.channels.size(); ++channel) {
      header_.channels().insert(kind.channels[channel], Imf::Channel(kind.type, kind.sampling, kind.sampling));
      add(kind, channel);
    }
  }
  const Imf::Header& header() const { return header_; }
  Imf::Header& header() { return header_; }
  const Imf::FrameBuffer& frame() const { return frame_; }

 private:
  static Imath::Box2i window(const ExrKind& kind) {
    return {{kind.left, kind.top},
            {kind.left + static_cast<int>(kind.width) - 1, kind.top + static_cast<int>(kind.height) - 1}};
  }
  void add(const ExrKind& kind, unsigned channel) {
    std::vector<std::uint32_t>& values = values_[channel];
    values.resize(std::size_t{kind.width} * kind.height);
    for (std::uint32_t y = 0; y < kind.height; ++y)
      for (std::uint32_t x = 0; x < kind.width; ++x) {
        void* const target = &values[std::size_t{y} * kind.width + x];
        const float value = exr_value(channel, x, y);
        if (kind.type == Imf::HALF)
          *static_cast<std::uint16_t*>(target) = half(value).bits();
        else if (kind.type == Imf::FLOAT)
          *static_cast<std::uint32_t*>(target) = std::bit_cast<std::uint32_t>(value);
        else
          *static_cast<std::uint32_t*>(target) = channel;
      }
    frame_.insert(kind.channels[channel], Imf::Slice::Make(kind.type, values.data(), header_.dataWindow(), 4,
                                                           4 * std::size_t{width_}, kind.sampling, kind.sampling));
  }

  Imf::Header header_;
  std::uint32_t width_;
  std::map<unsigned, std::vector<std::uint32_t>> values_;
  Imf::FrameBuffer frame_;
};

inline std::filesystem::path write_lines(const std::filesystem::path& path, const ExrKind& kind) {
  const ExrContent content(kind);
  Imf::OutputFile file(path.c_str(), content.header(), 0);
  file.setFrameBuffer(content.frame());
  file.writePixels(static_cast<int>(kind.height));
  return path;
}

/// Levels but the first stay empty where there are some: one is all that is read.
inline std::filesystem::path write_tiles(const std::filesystem::path& path, const ExrKind& kind) {
  ExrContent content(kind);
  content.header().setTileDescription(kind.tiles);
  Imf::TiledOutputFile file(path.c_str(), content.header(), 0);
  file.setFrameBuffer(content.frame());
  file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  return path;
}

/// Parts of scan lines, one per kind.
inline std::filesystem::path write_parts(const std::filesystem::path& path, const std::vector<ExrKind>& kinds) {
  std::vector<ExrContent> contents(kinds.begin(), kinds.end());
  std::vector<Imf::Header> headers;
  for (ExrContent& content : contents) {
    content.header().setName("part " + std::to_string(headers.size()));
    content.header().setType(Imf::SCANLINEIMAGE);
    headers.push_back(content.header());
  }
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()), false, 0);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    Imf::OutputPart part(file, static_cast<int>(i));
    part.setFrameBuffer(contents[i].frame());
    part.writePixels(static_cast<int>(kinds[i].height));
  }
  return path;
}

/// A picture of 4 x 4 pixels without samples.
inline std::filesystem::path write_deep(const std::filesystem::path& path) {
  Imf::Header header(4, 4);
  header.compression() = Imf::ZIPS_COMPRESSION;
  header.setType(Imf::DEEPSCANLINE);
  std::vector<unsigned> counts(16, 0);
  std::vector<const float*> samples(16, nullptr);
  Imf::DeepFrameBuffer frame;
  frame.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), sizeof(unsigned), 4 * sizeof(unsigned)));
  for (const char* name : {"R", "G", "B"}) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame.insert(name, Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()), sizeof(float*),
                                      4 * sizeof(float*), sizeof(float)));
  }
  Imf::DeepScanLineOutputFile file(path.c_str(), header, 0);
  file.setFrameBuffer(frame);
  file.writePixels(4);
  return path;
}

}  // namespace hiprt::test
