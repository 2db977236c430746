/// The .hair format: see load_shapes().

#include <tools/scene_io/ignored.h>
#include <tools/scene_io/shapes/shape_formats.h>

#include <hiprt_build/shapes.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are copied as they are");

struct HairHeader {
  char magic[4];
  std::uint32_t strands, points, arrays, default_segments;
  float default_thickness, default_transparency, default_color[3];
  char text[88];
};
static_assert(sizeof(HairHeader) == 128);

constexpr char kHairMagic[4] = {'H', 'A', 'I', 'R'};
enum Arrays : std::uint32_t { kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8, kColor = 16 };

/// Bytes of the arrays that are read, and that are there.
std::uint64_t size_of(const HairHeader& header) {
  const auto has = [&](Arrays array) { return (header.arrays & array) != 0 ? 1u : 0u; };
  return sizeof(HairHeader) + std::uint64_t{header.strands} * (2 * has(kSegments)) +
         std::uint64_t{header.points} *
             (12 * has(kPoints) + 4 * has(kThickness) + 4 * has(kTransparency) + 12 * has(kColor));
}

build::Result<HairHeader> read_header(std::span<const std::byte> bytes) {
  HairHeader header{};
  if (bytes.size() < sizeof(header))
    return invalid_input("truncated: " + std::to_string(bytes.size()) + " bytes, the header takes 128");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (std::memcmp(header.magic, kHairMagic, sizeof(kHairMagic)) != 0)
    return invalid_input("does not start with 'HAIR'");
  if ((header.arrays & ~(kSegments | kPoints | kThickness | kTransparency | kColor)) != 0)
    return invalid_input("the arrays at byte 12 are " + std::to_string(header.arrays) + ", known are bits 0 to 4");
  if ((header.arrays & kPoints) == 0) return invalid_input("has no array of points (bit 1 at byte 12)");
  if (bytes.size() < size_of(header))
    return invalid_input("truncated: " + std::to_string(bytes.size()) + " bytes, its " +
                         std::to_string(header.strands) + " strands and " + std::to_string(header.points) +
                         " points take " + std::to_string(size_of(header)));
  // A strand without segments has a point, too. So the file's size limits the number of strands.
  if (header.strands > header.points)
    return invalid_input("the header says " + std::to_string(header.strands) + " strands of " +
                         std::to_string(header.points) + " points, a strand has 1 or more");
  return header;
}

/// Points of each strand.
build::Result<std::vector<std::uint32_t>> points_of_strands(const HairHeader& header, const std::byte* segments) {
  std::vector<std::uint32_t> points(header.strands);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint64_t count = header.default_segments;
    if ((header.arrays & kSegments) != 0) {
      std::uint16_t here = 0;
      std::memcpy(&here, segments + 2 * i, sizeof(here));
      count = here;
    }
    sum += count + 1;
    if (sum > header.points)
      return invalid_input("strand " + std::to_string(i) + " ends at point " + std::to_string(sum) +
                           ", but the header says " + std::to_string(header.points) + " points");
    points[i] = static_cast<std::uint32_t>(count + 1);
  }
  if (sum == header.points) return points;
  return invalid_input("the strands have " + std::to_string(sum) + " points, but the header says " +
                       std::to_string(header.points));
}

/// The first bad point, by its strand.
build::Result<void> check_points(std::span<const ShapePoint> points, std::span<const std::uint32_t> of_strands) {
  const auto bad = std::find_if_not(points.begin(), points.end(),
                                    [](const ShapePoint& point) { return shape_detail::is_valid(point); });
  if (bad == points.end()) return {};
  auto location = static_cast<std::uint64_t>(bad - points.begin());
  std::size_t strand = 0;
  for (; location >= of_strands[strand]; ++strand) location -= of_strands[strand];
  return invalid_input("strand " + std::to_string(strand) + ", point " + std::to_string(location) + ": " +
                       shape_point_fault(*bad));
}

}  // namespace

build::Result<ShapeSet> read_hair(std::span<const std::byte> bytes) {
  const auto header = read_header(bytes);
  if (!header) return tl::unexpected(header.error());
  const std::byte* next = bytes.data() + sizeof(HairHeader);
  const auto strands = points_of_strands(*header, next);
  if (!strands) return tl::unexpected(strands.error());
  if ((header->arrays & kSegments) != 0) next += std::size_t{2} * header->strands;
  const std::byte* thickness = next + std::size_t{12} * header->points;
  ShapeSet shapes;
  shapes.kind = ShapeKind::kCurves;
  shapes.strands = header->strands;
  shapes.points.resize(header->points);
  for (std::size_t i = 0; i < shapes.points.size(); ++i) {
    if (interrupted_at(i)) return cancelled();
    float diameter = header->default_thickness;
    if ((header->arrays & kThickness) != 0) std::memcpy(&diameter, thickness + 4 * i, sizeof(diameter));
    std::memcpy(shapes.points[i].position, next + 12 * i, 12);
    shapes.points[i].radius = 0.5f * diameter;
  }
  if (auto checked = check_points(shapes.points, *strands); !checked) return tl::unexpected(checked.error());
  shapes.segments = build::strand_segments(*strands);
  Ignored ignored;
  if ((header->arrays & kTransparency) != 0) ignored.add("transparencies of points", header->points);
  if ((header->arrays & kColor) != 0) ignored.add("colours of points", header->points);
  ignored.add("bytes behind the last array", bytes.size() - size_of(*header));
  ignored.warn(shapes.warnings);
  return shapes;
}

std::vector<std::byte> hair_file(std::span<const std::uint32_t> points, std::span<const ShapePoint> shapes,
                                 const std::string& text) {
  HairHeader header{};
  std::memcpy(header.magic, kHairMagic, sizeof(kHairMagic));
  header.strands = static_cast<std::uint32_t>(points.size());
  header.points = static_cast<std::uint32_t>(shapes.size());
  header.arrays = kSegments | kPoints | kThickness;
  std::memcpy(header.text, text.data(), std::min(text.size(), sizeof(header.text) - 1));
  std::vector<std::byte> bytes(static_cast<std::size_t>(size_of(header)));
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::byte* next = bytes.data() + sizeof(header);
  for (const std::uint32_t count : points) {
    const auto segments = static_cast<std::uint16_t>(count - 1);
    std::memcpy(next, &segments, sizeof(segments));
    next += sizeof(segments);
  }
  std::byte* thickness = next + 12 * shapes.size();
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const float diameter = 2.0f * shapes[i].radius;
    std::memcpy(next + 12 * i, shapes[i].position, 12);
    std::memcpy(thickness + 4 * i, &diameter, sizeof(diameter));
  }
  return bytes;
}

}  // namespace hiprt::tools
