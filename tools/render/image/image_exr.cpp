#include <tools/render/image/image.h>
#include <tools/render/image/image_write.h>

#include <hiprt_build/file.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <string_view>

namespace hiprt::tools {
namespace {

/// A file in memory.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}

  void write(const char data[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (bytes_.size() < position_ + size) bytes_.resize(position_ + size);
    std::memcpy(bytes_.data() + position_, data, size);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = static_cast<std::size_t>(position); }

  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(bytes_)); }

 private:
  std::vector<char> bytes_;
  std::size_t position_ = 0;
};

struct Channel {
  const char* name;
  Imf::PixelType type;
  std::size_t offset;         ///< In Pixel.
  bool of_instances = false;  ///< Written of scenes of instances only.

  bool is_cost() const { return std::string_view(name).starts_with("cost."); }
};

constexpr std::size_t axis(std::size_t i) { return i * sizeof(float); }

constexpr std::array<Channel, 19> kChannels{{
    {"R", Imf::FLOAT, offsetof(Pixel, color) + axis(0)},
    {"G", Imf::FLOAT, offsetof(Pixel, color) + axis(1)},
    {"B", Imf::FLOAT, offsetof(Pixel, color) + axis(2)},
    {"N.X", Imf::FLOAT, offsetof(Pixel, normal) + axis(0)},
    {"N.Y", Imf::FLOAT, offsetof(Pixel, normal) + axis(1)},
    {"N.Z", Imf::FLOAT, offsetof(Pixel, normal) + axis(2)},
    {"P.X", Imf::FLOAT, offsetof(Pixel, position) + axis(0)},
    {"P.Y", Imf::FLOAT, offsetof(Pixel, position) + axis(1)},
    {"P.Z", Imf::FLOAT, offsetof(Pixel, position) + axis(2)},
    {"Z", Imf::FLOAT, offsetof(Pixel, depth)},
    {"id.geometry", Imf::UINT, offsetof(Pixel, geometry)},
    {"id.primitive", Imf::UINT, offsetof(Pixel, primitive)},
    {"cost.boxes", Imf::UINT, offsetof(Pixel, box_tests)},
    {"cost.leaves", Imf::UINT, offsetof(Pixel, leaf_tests)},
    {"cost.triangles", Imf::UINT, offsetof(Pixel, triangle_tests)},
    {"cost.steps", Imf::UINT, offsetof(Pixel, steps)},
    {"cost.fill", Imf::FLOAT, offsetof(Pixel, leaf_fill)},
    {"id.instance", Imf::UINT, offsetof(Pixel, instance), true},
    {"cost.instances", Imf::UINT, offsetof(Pixel, instance_tests), true},
}};
constexpr std::array<Channel, 14> kShadingChannels{{
    {"Albedo.R", Imf::FLOAT, offsetof(ShadingPixel, albedo) + axis(0)},
    {"Albedo.G", Imf::FLOAT, offsetof(ShadingPixel, albedo) + axis(1)},
    {"Albedo.B", Imf::FLOAT, offsetof(ShadingPixel, albedo) + axis(2)},
    {"Ns.X", Imf::FLOAT, offsetof(ShadingPixel, normal) + axis(0)},
    {"Ns.Y", Imf::FLOAT, offsetof(ShadingPixel, normal) + axis(1)},
    {"Ns.Z", Imf::FLOAT, offsetof(ShadingPixel, normal) + axis(2)},
    {"u", Imf::FLOAT, offsetof(ShadingPixel, u)},
    {"v", Imf::FLOAT, offsetof(ShadingPixel, v)},
    {"Variance.R", Imf::FLOAT, offsetof(ShadingPixel, variance) + axis(0)},
    {"Variance.G", Imf::FLOAT, offsetof(ShadingPixel, variance) + axis(1)},
    {"Variance.B", Imf::FLOAT, offsetof(ShadingPixel, variance) + axis(2)},
    {"RelativeVariance.R", Imf::FLOAT, offsetof(ShadingPixel, relative_variance) + axis(0)},
    {"RelativeVariance.G", Imf::FLOAT, offsetof(ShadingPixel, relative_variance) + axis(1)},
    {"RelativeVariance.B", Imf::FLOAT, offsetof(ShadingPixel, relative_variance) + axis(2)},
}};
static_assert(sizeof(Vec3) == 3 * sizeof(float));

/// @return false when progress said so.
bool encode(MemoryStream& stream, const Image& image, const ImageAttributes& attributes,
            const EncodeProgress& progress) {
  Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [name, value] : attributes) header.insert(name, Imf::StringAttribute(value));
  Imf::FrameBuffer frame;
  const auto add = [&](const Channel& channel, const auto& pixels) {
    using Element = typename std::decay_t<decltype(pixels)>::value_type;
    // OpenEXR's frame buffers serve readers too; writing leaves the pixels alone.
    auto* base = const_cast<char*>(reinterpret_cast<const char*>(pixels.data()));
    header.channels().insert(channel.name, Imf::Channel(channel.type));
    frame.insert(channel.name,
                 Imf::Slice(channel.type, base + channel.offset, sizeof(Element), sizeof(Element) * image.width));
  };
  for (const Channel& channel : kChannels)
    if ((image.has_instances || !channel.of_instances) && (image.has_costs || !channel.is_cost()))
      add(channel, image.pixels);
  if (!image.shading.empty())
    for (const Channel& channel : kShadingChannels) add(channel, image.shading);
  Imf::OutputFile file(stream, header, /*numThreads=*/0);
  file.setFrameBuffer(frame);
  constexpr std::uint32_t kRows = 16;  // Of a ZIP block.
  for (std::uint32_t y = 0; y < image.height; y += kRows) {
    if (progress && !progress(static_cast<double>(y) / image.height)) return false;
    file.writePixels(static_cast<int>(std::min(kRows, image.height - y)));
  }
  return true;
}

}  // namespace

build::Result<std::size_t> write_exr(const std::filesystem::path& path, const Image& image,
                                     const ImageAttributes& attributes, const EncodeProgress& progress) {
  MemoryStream stream;
  try {
    if (!encode(stream, image, attributes, progress))
      return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled"});
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return tl::unexpected(
        build::Error{build::ErrorCode::kIo, "cannot encode '" + path.string() + "': " + error.what()});
  }
  if (auto written = build::write_file(path, stream.bytes()); !written) return tl::unexpected(written.error());
  return stream.bytes().size();
}

}  // namespace hiprt::tools
