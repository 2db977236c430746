#pragma once
/// Pictures read back from their files, by the libraries' own readers.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <png.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace hiprt::test {

struct ExrFile {
  std::uint32_t width = 0, height = 0;
  std::map<std::string, std::vector<float>> floats;
  std::map<std::string, std::vector<std::uint32_t>> uints;
  std::map<std::string, std::string> attributes;

  float at(const std::string& channel, std::uint32_t x, std::uint32_t y) const {
    return floats.at(channel).at(std::size_t{y} * width + x);
  }
  std::uint32_t uint_at(const std::string& channel, std::uint32_t x, std::uint32_t y) const {
    return uints.at(channel).at(std::size_t{y} * width + x);
  }
};

inline ExrFile read_exr(const std::filesystem::path& path) {
  Imf::InputFile file(path.c_str(), /*numThreads=*/0);
  const auto window = file.header().dataWindow();
  ExrFile result;
  result.width = static_cast<std::uint32_t>(window.max.x - window.min.x + 1);
  result.height = static_cast<std::uint32_t>(window.max.y - window.min.y + 1);
  Imf::FrameBuffer frame;
  const auto& channels = file.header().channels();
  for (auto i = channels.begin(); i != channels.end(); ++i) {
    const std::size_t size = std::size_t{result.width} * result.height;
    char* data = nullptr;
    if (i.channel().type == Imf::UINT) {
      auto& values = result.uints[i.name()];
      values.resize(size);
      data = reinterpret_cast<char*>(values.data());
    } else {
      auto& values = result.floats[i.name()];
      values.resize(size);
      data = reinterpret_cast<char*>(values.data());
    }
    frame.insert(i.name(), Imf::Slice(i.channel().type, data, 4, 4 * std::size_t{result.width}));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  for (auto i = file.header().begin(); i != file.header().end(); ++i)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&i.attribute()))
      result.attributes[i.name()] = text->value();
  return result;
}

struct PngFile {
  std::uint32_t width = 0, height = 0;
  std::vector<unsigned char> bytes;

  /// @param channel 0 red, 1 green, 2 blue.
  int at(std::uint32_t x, std::uint32_t y, unsigned channel) const {
    return bytes.at((std::size_t{y} * width + x) * 3 + channel);
  }
};

inline PngFile read_png(const std::filesystem::path& path) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) throw std::runtime_error(image.message);
  if (image.format != PNG_FORMAT_RGB) throw std::runtime_error("not 8-bit RGB");
  PngFile result{image.width, image.height, std::vector<unsigned char>(PNG_IMAGE_SIZE(image))};
  if (png_image_finish_read(&image, nullptr, result.bytes.data(), 0, nullptr) == 0)
    throw std::runtime_error(image.message);
  return result;
}

}  // namespace hiprt::test
