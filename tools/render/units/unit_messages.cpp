#include <tools/render/units/unit_messages.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// Larger rectangles do not fit into memory: their sizes are damaged.
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 32;

tl::unexpected<build::Error> malformed(const char* what, std::size_t size) {
  return invalid_input(std::string("a message with a ") + what + " of a picture is malformed (" + std::to_string(size) +
                       " bytes)");
}

}  // namespace

std::vector<std::byte> encode(const UnitJob& job) {
  ByteWriter writer;
  writer.add(job.unit);
  if (job.unit.first != 0) writer.add_bytes(job.state);
  return std::move(writer.bytes());
}

build::Result<UnitJob> decode_job(std::span<const std::byte> bytes, std::size_t pixel_bytes) {
  ByteReader reader(bytes);
  UnitJob job{reader.get<PictureUnit>(), {}};
  const auto state = reader.rest();
  const std::uint64_t pixels = job.unit.pixels();
  if (!reader.ok() || pixels > kMostPixels || state.size() != (job.unit.first == 0 ? 0 : pixels * pixel_bytes))
    return malformed("unit", bytes.size());
  job.state.assign(state.begin(), state.end());
  job.state.resize(pixels * pixel_bytes);
  return job;
}

std::vector<std::byte> encode(const UnitResult& result) {
  ByteWriter writer;
  writer.add(result.job.unit);
  writer.add(result.rays);
  writer.add(result.seconds);
  writer.add(std::uint8_t{result.error.has_value()});
  if (result.error) {
    writer.add(result.error->code);
    writer.add_text(result.error->message);
  } else {
    writer.add_bytes(result.job.state);
  }
  return std::move(writer.bytes());
}

build::Result<UnitResult> decode_result(std::span<const std::byte> bytes, std::size_t pixel_bytes) {
  ByteReader reader(bytes);
  UnitResult result{{reader.get<PictureUnit>(), {}}, reader.get<RayCounts>(), reader.get<double>(), {}};
  if (reader.get<std::uint8_t>() != 0) {
    const auto code = reader.get<build::ErrorCode>();
    result.error = build::Error{code, reader.get_text()};
    if (!reader.ok()) return malformed("result", bytes.size());
    return result;
  }
  const auto state = reader.rest();
  if (!reader.ok() || result.job.unit.pixels() > kMostPixels || state.size() != result.job.unit.pixels() * pixel_bytes)
    return malformed("result", bytes.size());
  result.job.state.assign(state.begin(), state.end());
  return result;
}

}  // namespace hiprt::tools
