#include <tools/render/units/checkpoint.h>

#include <tools/base/bytes.h>
#include <tools/base/digest.h>
#include <tools/base/errors.h>
#include <tools/base/read_input.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/file.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace hiprt::tools {
namespace {

using nlohmann::json;

constexpr std::string_view kMagic = "HIPRTPIC";
constexpr std::size_t kHashBytes = sizeof(Digest);

json header_of(const PictureKey& key, const PictureState& state) {
  return {{"key", key},
          {"width", state.grid.width},
          {"height", state.grid.height},
          {"tile", state.grid.tile},
          {"pixel_bytes", state.pixel_bytes},
          {"rays", {state.rays.primary, state.rays.secondary, state.rays.shadow, state.rays.on_gpu}},
          {"exchange", {state.rays.sent, state.rays.messages, state.rays.bytes}},
          {"seconds", state.seconds}};
}

tl::unexpected<build::Error> damaged(const std::string& what) {
  return invalid_input(what + ": the checkpoint is damaged; remove it to begin again");
}

/// Reads the tiles behind the header.
build::Result<void> read_tiles(ByteReader& reader, std::uint32_t steps, PictureState& state) {
  for (std::uint64_t next = 0; !reader.at_end();) {
    const auto tile = reader.get<std::uint32_t>(), done = reader.get<std::uint32_t>();
    if (!reader.ok() || tile < next || tile >= state.grid.tiles() || done == 0 || done > steps)
      return damaged("tile " + std::to_string(tile) + " with " + std::to_string(done) + " steps");
    const PictureUnit unit = state.grid.unit(tile, 1, 0, done);
    const auto pixels = reader.take(unit.pixels() * state.pixel_bytes);
    if (!reader.ok()) return damaged("tile " + std::to_string(tile) + " has no pixels");
    state.paste(unit, pixels);
    state.done[tile] = done;
    next = std::uint64_t{tile} + 1;
  }
  return {};
}

build::Result<PictureState> read_state(const json& header, ByteReader& reader, const PictureKey& key,
                                       const PictureGrid& grid, std::uint32_t steps, std::size_t pixel_bytes) {
  const auto other = difference(header.at("key").get<PictureKey>(), key);
  if (!other.empty())
    return invalid_input("it is the checkpoint of another picture: " + other + "; give another name to --resume");
  const PictureGrid there{header.at("width"), header.at("height"), header.at("tile")};
  if (there.width != grid.width || there.height != grid.height || there.tile == 0 || there.tile > 4096 ||
      header.at("pixel_bytes") != pixel_bytes)
    return damaged("size " + std::to_string(there.width) + "x" + std::to_string(there.height));
  PictureState state(there, pixel_bytes);
  const auto rays = header.at("rays").get<std::array<std::uint64_t, 4>>();
  state.rays.primary = rays[0];
  state.rays.secondary = rays[1];
  state.rays.shadow = rays[2];
  state.rays.on_gpu = rays[3];
  const auto exchange = header.at("exchange").get<std::array<std::uint64_t, 3>>();
  state.rays.sent = exchange[0];
  state.rays.messages = exchange[1];
  state.rays.bytes = exchange[2];
  state.seconds = header.at("seconds");
  if (auto read = read_tiles(reader, steps, state); !read) return tl::unexpected(std::move(read.error()));
  return state;
}

}  // namespace

std::string difference(const PictureKey& there, const PictureKey& here) {
  const auto [a, b] = std::mismatch(there.begin(), there.end(), here.begin(), here.end());
  if (a == there.end() && b == here.end()) return {};
  if (a == there.end()) return b->first + " is only here";
  if (b == here.end() || a->first != b->first) return a->first + " is only there";
  return a->first + " is " + a->second + " there and " + b->second + " here";
}

std::vector<std::byte> encode_checkpoint(const PictureKey& key, const PictureState& state) {
  ByteWriter writer;
  writer.bytes().reserve(state.pixels.size() + 8 * state.done.size() + 4096);
  writer.add_bytes(std::as_bytes(std::span(kMagic)));
  writer.add_text(header_of(key, state).dump(-1, ' ', false, json::error_handler_t::replace));
  for (std::uint32_t tile = 0; tile < state.grid.tiles(); ++tile) {
    if (state.done[tile] == 0) continue;
    writer.add(tile);
    writer.add(state.done[tile]);
    writer.add_bytes(state.cut(state.grid.unit(tile, 1, state.done[tile], 0)));
  }
  writer.add(digest_of(writer.bytes()));
  return std::move(writer.bytes());
}

build::Result<PictureState> decode_checkpoint(std::span<const std::byte> bytes, const PictureKey& key,
                                              const PictureGrid& grid, std::uint32_t steps, std::size_t pixel_bytes) {
  if (bytes.size() < kMagic.size() + kHashBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    return invalid_input("no checkpoint of a picture: it does not begin with " + std::string(kMagic));
  const auto content = bytes.first(bytes.size() - kHashBytes);
  const Digest hash = digest_of(content);
  if (std::memcmp(hash.data(), bytes.data() + content.size(), kHashBytes) != 0) return damaged("wrong checksum");
  ByteReader reader(content.subspan(kMagic.size()));
  const std::string header = reader.get_text();
  try {
    return read_state(json::parse(header), reader, key, grid, steps, pixel_bytes);
  } catch (const json::exception&) {
    return damaged("malformed header");
  }
}

Checkpoint::Checkpoint(std::string path, PictureKey key, double seconds)
    : path_(std::move(path)),
      key_(std::move(key)),
      seconds_(seconds),
      next_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))) {}

build::Result<std::optional<PictureState>> Checkpoint::load(const PictureGrid& grid, std::uint32_t steps,
                                                            std::size_t pixel_bytes) const {
  std::error_code error;
  if (!std::filesystem::exists(path_, error)) return std::nullopt;
  const auto file = read_input(path_);
  if (!file) return tl::unexpected(file.error());
  auto state = decode_checkpoint(file->bytes(), key_, grid, steps, pixel_bytes);
  if (!state) return fail(state.error().code, path_ + ": " + state.error().message);
  return std::optional<PictureState>(std::move(*state));
}

Checkpoint::Written Checkpoint::write_bytes(const std::string& path, const std::vector<std::byte>& bytes) {
  build::Stopwatch watch;
  auto result = build::write_file(path, bytes);
  return {std::move(result), watch.lap()};
}

build::Result<void> Checkpoint::keep(const PictureState& state) {
  using std::chrono::duration;
  build::Result<void> last;
  if (writing_.valid()) {
    if (writing_.wait_for(duration<double>(0.0)) != std::future_status::ready) return {};
    Written written = writing_.get();
    constexpr double kMostPart = 20.0;
    next_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                               duration<double>(std::max(seconds_, kMostPart * written.seconds)));
    return std::move(written.result);
  }
  if (Clock::now() < next_) return last;
  writing_ = std::async(std::launch::async,
                        [path = path_, bytes = encode_checkpoint(key_, state)] { return write_bytes(path, bytes); });
  return last;
}

build::Result<void> Checkpoint::write(const PictureState& state) {
  if (writing_.valid()) writing_.get();
  return write_bytes(path_, encode_checkpoint(key_, state)).result;
}

void Checkpoint::remove() {
  if (writing_.valid()) writing_.get();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace hiprt::tools
