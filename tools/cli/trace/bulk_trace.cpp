#include <tools/cli/trace/bulk_trace.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/read_input.h>
#include <tools/cli/trace/trace_records.h>
#include <tools/cli/trace/trace_work.h>
#include <tools/distributed/broadcast.h>
#include <tools/distributed/deal.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/file.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace hiprt::tools {
namespace {

struct PathsHeader {
  std::uint32_t count, levels;
};

std::uint64_t rays_of_block(const BulkScene& scene, std::uint64_t block) {
  return std::min(scene.block, scene.rays.count() - block * scene.block);
}

/// @return the records of the block: its hits, then its paths if they are wanted.
build::Result<std::vector<std::byte>> trace_block(const BulkScene& scene, const ThreadLimit& limit,
                                                  std::uint64_t block) {
  if (scene.gpu)
    if (auto current = scene.gpu->make_current(); !current) return tl::unexpected(std::move(current.error()));
  const auto count = static_cast<std::size_t>(rays_of_block(scene, block));
  auto rays = scene.rays.read(block * scene.block, count);
  if (!rays) return tl::unexpected(std::move(rays.error()));
  for (Ray& ray : *rays) ray.time = scene.time;
  std::vector<Hit> hits(count);
  std::vector<std::uint32_t> paths(count * scene.scene.levels);
  const TraceWork work{scene.scene, scene.query, scene.policies, *rays, hits, paths};
  if (auto seconds = trace_batch(work, scene.gpu, limit, {}); !seconds)
    return tl::unexpected(std::move(seconds.error()));
  const auto records = hit_records(scene.scene, hits, paths);
  if (!records) return tl::unexpected(records.error());
  ByteWriter writer;
  writer.add_bytes(std::as_bytes(std::span(*records)));
  if (scene.paths) {
    const auto of_instances = path_records(scene.scene, paths);
    writer.add_bytes(std::as_bytes(std::span(of_instances)));
  }
  return std::move(writer.bytes());
}

/// The files of rank 0, and what is done of them.
class Writer {
 public:
  Writer(const BulkScene& scene, const BulkOutput& output) : scene_(scene), output_(output) {}

  build::Result<void> open() {
    journal_.done.resize(scene_.blocks());
    const auto kept = load_journal();
    if (!kept) return tl::unexpected(kept.error());
    const std::uint64_t rays = scene_.rays.count(), levels = scene_.scene.levels;
    auto hits = PartialOutput::open(output_.hits, rays * sizeof(HitRecord), *kept);
    if (!hits) return tl::unexpected(std::move(hits.error()));
    hits_ = std::move(*hits);
    if (!scene_.paths) return {};
    auto paths = PartialOutput::open(output_.paths, sizeof(PathsHeader) + rays * levels * sizeof(PathRecord), *kept);
    if (!paths) return tl::unexpected(std::move(paths.error()));
    paths_ = std::move(*paths);
    const PathsHeader header{static_cast<std::uint32_t>(std::min<std::uint64_t>(rays, ~std::uint32_t{0})),
                             static_cast<std::uint32_t>(levels)};
    return paths_->write(0, std::as_bytes(std::span(&header, 1)));
  }

  const BlockJournal& journal() const { return journal_; }

  build::Result<void> take(std::uint64_t block, std::span<const std::byte> bytes) {
    const std::uint64_t count = rays_of_block(scene_, block), first = block * scene_.block;
    const std::uint64_t levels = scene_.paths ? scene_.scene.levels : 0;
    if (bytes.size() != count * (sizeof(HitRecord) + levels * sizeof(PathRecord)))
      return invalid_input("block " + std::to_string(block) + " came back with " + std::to_string(bytes.size()) +
                           " bytes: do all ranks have the same files?");
    const auto hits = bytes.first(static_cast<std::size_t>(count * sizeof(HitRecord)));
    ByteReader reader(hits);
    for (std::uint64_t i = 0; i < count; ++i) journal_.hits += reader.get<HitRecord>().primitive != kInvalidId ? 1 : 0;
    if (auto written = hits_->write(first * sizeof(HitRecord), hits); !written) return written;
    if (paths_) {
      const std::uint64_t offset = sizeof(PathsHeader) + first * levels * sizeof(PathRecord);
      if (auto written = paths_->write(offset, bytes.subspan(hits.size())); !written) return written;
    }
    journal_.done[block] = 1;
    return {};
  }

  /// Writes the journal, if it is time or @p now.
  build::Result<void> keep(bool now) {
    const double lap = watch_.lap();
    journal_.seconds += lap;
    since_ += lap;
    if (output_.resume.file.empty() || (!now && since_ < output_.resume.seconds)) return {};
    since_ = 0.0;
    // What the journal calls done must be on the disk before it.
    if (auto flushed = flush(); !flushed) return flushed;
    return build::write_file(output_.resume.file, encode(output_.key, journal_));
  }

  build::Result<void> publish() {
    auto done = flush();
    if (done) done = hits_->publish();
    if (done && paths_) done = paths_->publish();
    if (!done) return done;
    published_ = true;
    std::error_code ignored;
    if (!output_.resume.file.empty()) std::filesystem::remove(output_.resume.file, ignored);
    return {};
  }

  /// Without a checkpoint a run that fails leaves no files.
  ~Writer() {
    if (published_ || !output_.resume.file.empty()) return;
    if (hits_) hits_->remove();
    if (paths_) paths_->remove();
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

 private:
  /// @return whether there was a journal.
  build::Result<bool> load_journal() {
    std::error_code error;
    if (output_.resume.file.empty() || !std::filesystem::exists(output_.resume.file, error)) return false;
    const auto file = read_input(output_.resume.file);
    if (!file) return tl::unexpected(file.error());
    auto journal = decode_journal(file->bytes(), output_.key, journal_.done.size());
    if (!journal) return fail(journal.error().code, output_.resume.file + ": " + journal.error().message);
    journal_ = std::move(*journal);
    return true;
  }

  build::Result<void> flush() const {
    auto done = hits_->flush();
    return done && paths_ ? paths_->flush() : done;
  }

  const BulkScene& scene_;
  const BulkOutput& output_;
  BlockJournal journal_;
  std::optional<PartialOutput> hits_, paths_;
  build::Stopwatch watch_;
  double since_ = 0.0;  ///< Seconds from the last write of the journal.
  bool published_ = false;
};

std::vector<std::uint64_t> open_blocks(const BlockJournal& journal) {
  std::vector<std::uint64_t> open;
  for (std::uint64_t block = 0; block < journal.done.size(); ++block)
    if (journal.done[block] == 0) open.push_back(block);
  return open;
}

/// Calls of rank 0 while blocks are traced.
DealEvents events_of(Writer& writer, const std::vector<std::uint64_t>& open, const BulkOutput& output) {
  DealEvents events;
  events.collect = [&](std::size_t unit, int, const std::vector<std::byte>& bytes) {
    return writer.take(open[unit], bytes);
  };
  events.tick = [&, told = false]() mutable {
    const double done = static_cast<double>(open_blocks(writer.journal()).size());
    if (output.progress) output.progress(1.0 - done / static_cast<double>(writer.journal().done.size()));
    const auto kept = writer.keep(false);
    if (!kept && !std::exchange(told, true)) output.warn("the checkpoint is not kept: " + kept.error().message);
    return !interrupted();
  };
  return events;
}

/// The error of a run that did not come to its end.
build::Result<void> check(const build::Result<DealReport>& report, const Ranks& ranks, const BulkOutput& output) {
  const std::string hint = resume_hint(output.resume);
  if (!report) return fail(report.error().code, report.error().message + hint);
  if (report->not_done.empty()) return {};
  std::string names;
  for (const int rank : report->lost_ranks) names += (names.empty() ? "" : ", ") + ranks.name(rank);
  return fail(build::ErrorCode::kBackend,
              names + " was lost, and " + std::to_string(report->not_done.size()) + " blocks are not traced" + hint);
}

/// Rank 0 deals the blocks that @p open has, and writes what comes back. The others get that list from it.
build::Result<DealReport> deal_blocks(Ranks& ranks, const build::Result<BulkScene>& scene, const BulkOutput& output,
                                      std::vector<std::uint64_t> open, Writer* writer) {
  std::vector<int> everyone;
  for (int rank = 0; rank < ranks.size(); ++rank) everyone.push_back(rank);
  ByteWriter list;
  list.add_array(std::span(std::as_const(open)));
  const auto shared =
      broadcast(ranks, std::make_shared<const std::vector<std::byte>>(std::move(list.bytes())), everyone);
  if (!shared) return tl::unexpected(shared.error());
  open = ByteReader(**shared).get_array<std::uint64_t>();
  const ThreadLimit limit(scene ? scene->threads : 1);
  const DealWork work = [&](const DealtUnit& unit) -> build::Result<std::vector<std::byte>> {
    auto result = scene ? trace_block(*scene, limit, open[unit.index()])
                        : build::Result<std::vector<std::byte>>(tl::unexpected(scene.error()));
    if (!result && !ranks.is_first()) result.error().message = ranks.name(ranks.rank()) + ": " + result.error().message;
    return result;
  };
  const std::vector<double> costs(open.size(), 1.0);
  const DealOptions options{.ahead = 2, .retries = 3, .lossy = output.lossy};
  return deal(ranks, costs, options, work, writer == nullptr ? DealEvents{} : events_of(*writer, open, output));
}

}  // namespace

build::Result<BulkResult> trace_in_blocks(Ranks& ranks, const build::Result<BulkScene>& scene,
                                          const BulkOutput& output) {
  if (!ranks.is_first()) {
    const auto report = deal_blocks(ranks, scene, output, {}, nullptr);
    if (report || ranks.must_stop()) return BulkResult{};
    return tl::unexpected(report.error());
  }
  if (!scene) return tl::unexpected(scene.error());
  Writer writer(*scene, output);
  if (auto opened = writer.open(); !opened) return tl::unexpected(std::move(opened.error()));
  const auto report = deal_blocks(ranks, scene, output, open_blocks(writer.journal()), &writer);
  if (auto good = check(report, ranks, output); !good) {
    // The error that ended the run is told, not one of the checkpoint.
    static_cast<void>(writer.keep(true));
    return tl::unexpected(std::move(good.error()));
  }
  static_cast<void>(writer.keep(false));
  if (auto published = writer.publish(); !published) return tl::unexpected(std::move(published.error()));
  return BulkResult{writer.journal().hits, writer.journal().seconds};
}

}  // namespace hiprt::tools
