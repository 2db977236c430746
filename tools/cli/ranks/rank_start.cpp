#include <tools/cli/ranks/rank_start.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/distributed/broadcast.h>
#include <tools/render/path/path_data_bytes.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/file.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

namespace hiprt::tools {
namespace {

/// Between two looks for signals.
constexpr std::chrono::milliseconds kLook{100};

/// RankBegin as bytes.
struct BeginRecord {
  std::int32_t gpu;  ///< -1: none.
  std::uint32_t threads;
  Camera camera;
  Digest scene;
  std::uint64_t broadcast;
};

build::Error malformed(const std::string& from) {
  return {build::ErrorCode::kInvalidInput, from + ": a message is malformed: do all ranks run the same program?"};
}

}  // namespace

GpuChoice take_share(const RankShare& share, unsigned& threads) {
  if (threads == 0) threads = share.threads;
  return {true, share.gpu};
}

RankMeans own_means(const Ranks& ranks, bool gpus) {
  return {ranks.host(ranks.rank()), gpus ? GpuTracer::devices() : std::vector<std::string>{}, own_processors()};
}

std::vector<int> LeadStart::others() const {
  std::vector<int> result;
  for (int rank = 1; rank < watch_.ranks().size(); ++rank)
    if (!watch_.is_gone(rank)) result.push_back(rank);
  return result;
}

build::Result<void> LeadStart::collect(int tag, const std::function<build::Result<void>(const RankMessage&)>& take) {
  std::vector<char> came(static_cast<std::size_t>(watch_.ranks().size()));
  const auto missing = [&](int rank) { return came[static_cast<std::size_t>(rank)] == 0; };
  while (std::ranges::any_of(others(), missing)) {
    if (interrupted()) return cancelled();
    if (auto news = watch_.news(); !news) return tl::unexpected(std::move(news.error()));
    const auto message = watch_.ranks().receive(tag, kLook);
    if (!message) continue;
    came[static_cast<std::size_t>(message->from)] = 1;
    if (auto taken = take(*message); !taken) return taken;
  }
  return {};
}

build::Result<RankShare> LeadStart::gather(const RankMeans& own) {
  std::vector<RankMeans> means(static_cast<std::size_t>(watch_.ranks().size()));
  means[0] = own;
  auto all = collect(RenderTag::kMeans, [&](const RankMessage& message) -> build::Result<void> {
    auto told = decode_means(message.bytes);
    if (!told) return tl::unexpected(malformed(watch_.ranks().name(message.from)));
    means[static_cast<std::size_t>(message.from)] = std::move(*told);
    return {};
  });
  if (!all) return tl::unexpected(std::move(all.error()));
  shares_ = share_hosts(means);
  return shares_[0];
}

void LeadStart::begin(std::span<const std::byte> bytes, const Camera& camera, bool broadcasts) {
  const Digest digest = digest_of(bytes);
  for (const int rank : others()) {
    const RankShare& share = shares_[static_cast<std::size_t>(rank)];
    ByteWriter writer;
    writer.add(BeginRecord{share.gpu.value_or(-1), share.threads, camera, digest, broadcasts ? 1u : 0u});
    watch_.ranks().send(rank, RenderTag::kBegin, std::move(writer.bytes()));
  }
  if (broadcasts) share_bytes(std::vector<std::byte>(bytes.begin(), bytes.end()));
}

void LeadStart::send(const PathData& data) { share_bytes(encode(data)); }

void LeadStart::share_bytes(std::vector<std::byte> bytes) {
  // Rank 0 does not wait here, and so it cannot fail.
  static_cast<void>(
      broadcast(watch_.ranks(), std::make_shared<const std::vector<std::byte>>(std::move(bytes)), others()));
}

build::Result<std::vector<unsigned>> LeadStart::wait(const PictureKey& key, unsigned own_workers) {
  std::vector<unsigned> workers(static_cast<std::size_t>(watch_.ranks().size()));
  auto all = collect(RenderTag::kReady, [&](const RankMessage& message) -> build::Result<void> {
    const std::string name = watch_.ranks().name(message.from);
    ByteReader reader(message.bytes);
    workers[static_cast<std::size_t>(message.from)] = reader.get<std::uint32_t>();
    PictureKey theirs(std::min<std::uint64_t>(reader.get<std::uint64_t>(), key.size()));
    for (auto& [word, value] : theirs) {
      word = reader.get_text();
      value = reader.get_text();
    }
    if (!reader.ok()) return tl::unexpected(malformed(name));
    const std::string other = difference(theirs, key);
    if (other.empty()) return {};
    return invalid_input(name + " would compute another picture: " + other);
  });
  if (!all) return tl::unexpected(std::move(all.error()));
  workers[0] = own_workers;
  for (int rank = 1; rank < watch_.ranks().size(); ++rank)
    if (watch_.is_gone(rank)) workers[static_cast<std::size_t>(rank)] = 0;
  return workers;
}

build::Result<RankMessage> FollowStart::wait(int tag) {
  while (!ranks_.must_stop() && !interrupted())
    if (auto message = ranks_.receive(tag, kLook)) return std::move(*message);
  if (auto health = ranks_.health(); !health) return tl::unexpected(std::move(health.error()));
  return cancelled();
}

build::Result<SharedBytes> FollowStart::shared_bytes() {
  const int own = ranks_.rank();
  return broadcast(ranks_, {}, std::span(&own, 1));
}

build::Result<RankBegin> FollowStart::begin(const RankMeans& own) {
  ranks_.send(0, RenderTag::kMeans, encode(own));
  const auto message = wait(RenderTag::kBegin);
  if (!message) return tl::unexpected(message.error());
  ByteReader reader(message->bytes);
  const auto record = reader.get<BeginRecord>();
  if (!reader.ok() || !reader.at_end()) return tl::unexpected(malformed("rank 0"));
  RankBegin begin{{{}, record.threads}, record.camera, record.scene, record.broadcast != 0};
  if (record.gpu >= 0) begin.share.gpu = record.gpu;
  return begin;
}

build::Result<BvhFile> FollowStart::scene(const RankBegin& begin, const std::string& path) {
  auto buffer = bytes(begin, path);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  return open_bytes(path, std::move(buffer));
}

build::Result<build::Buffer> FollowStart::bytes(const RankBegin& begin, const std::string& path) {
  build::Buffer buffer;
  if (begin.broadcast) {
    const auto bytes = shared_bytes();
    if (!bytes) return tl::unexpected(bytes.error());
    buffer = build::Buffer::uninitialized((*bytes)->size());
    std::memcpy(buffer.bytes().data(), (*bytes)->data(), (*bytes)->size());
  } else {
    auto mapped = build::map_file(path);
    if (!mapped) return fail(mapped.error().code, mapped.error().message + "; with --broadcast only rank 0 reads it");
    buffer = std::move(*mapped);
  }
  const Digest digest = digest_of(std::as_const(buffer).bytes());
  if (digest != begin.scene)
    return invalid_input(path + ": the checksum is " + to_text(digest) + ", that of rank 0's file is " +
                         to_text(begin.scene) + "; with --broadcast only rank 0 reads it");
  return buffer;
}

build::Result<PathData> FollowStart::path_data() {
  const auto bytes = shared_bytes();
  if (!bytes) return tl::unexpected(bytes.error());
  auto data = decode_path_data(**bytes);
  if (!data) return tl::unexpected(malformed("rank 0"));
  return std::move(*data);
}

void FollowStart::ready(const PictureKey& key, unsigned workers) {
  ByteWriter writer;
  writer.add(std::uint32_t{workers});
  writer.add(std::uint64_t{key.size()});
  for (const auto& [word, value] : key) {
    writer.add_text(word);
    writer.add_text(value);
  }
  ranks_.send(0, RenderTag::kReady, std::move(writer.bytes()));
}

}  // namespace hiprt::tools
