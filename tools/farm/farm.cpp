#include <tools/farm/farm.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/build/shape_geometries.h>
#include <tools/distributed/deal.h>

#include <hiprt_build/exec/stopwatch.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <new>
#include <optional>
#include <thread>
#include <utility>

namespace hiprt::tools {
namespace {

/// The files of an asset in memory.
struct Loaded {
  std::vector<Mesh> meshes;
  std::vector<ShapeSet> shapes;
};

build::Result<Loaded> load(const Asset& asset, std::uint64_t max_memory, AssetResult& result) {
  const MemoryLimit limit(max_memory);
  Loaded loaded;
  for (const std::string& file : asset.meshes) {
    auto mesh = load_mesh(file);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const std::string& warning : mesh->warnings) result.warnings.push_back(file + ": " + warning);
    if (mesh->skipped_faces != 0)
      result.warnings.push_back(file + ": skipped " + std::to_string(mesh->skipped_faces) +
                                " faces with fewer than three corners");
    loaded.meshes.push_back(std::move(*mesh));
  }
  for (const std::string& file : asset.shapes) {
    auto shapes = load_shapes(file);
    if (!shapes) return tl::unexpected(shapes.error());
    for (const std::string& warning : shapes->warnings) result.warnings.push_back(file + ": " + warning);
    loaded.shapes.push_back(std::move(*shapes));
  }
  return loaded;
}

std::uint64_t peak_of_process() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

/// Sends how far a build is, a few times per second.
build::ProgressCallback progress_of(const DealtUnit& unit) {
  return [&unit, last = std::chrono::steady_clock::time_point{}](const build::Progress& progress) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (now - last > std::chrono::milliseconds(200)) {
      last = now;
      unit.note(std::as_bytes(std::span(&progress.fraction, 1)));
    }
    return !interrupted() && !unit.must_stop();
  };
}

const char* state_of(CacheUse use) {
  return use == CacheUse::kHit ? "hit" : use == CacheUse::kMiss ? "miss" : "damaged";
}

/// The work of a rank: one asset.
class AssetBuilder {
 public:
  AssetBuilder(const std::vector<Asset>& assets, const BvhCache& cache, const BuildCommand& command,
               const std::string& tool)
      : assets_(assets), cache_(cache), command_(command), tool_(tool) {}

  build::Result<std::vector<std::byte>> operator()(const DealtUnit& unit) const {
    AssetResult result;
    const Asset& asset = assets_[unit.index()];
    const auto built = build(asset, unit, result);
    if (interrupted() || unit.must_stop()) return cancelled();
    if (!built) {
      result.state = "failed";
      result.error = built.error().message;
    } else if (!built->not_stored.empty()) {
      // Nor could the others be written.
      return fail(build::ErrorCode::kIo, "asset '" + asset.name + "': " + built->not_stored);
    } else {
      fill(result, *built);
    }
    result.process_bytes = peak_of_process();
    return packed(result);
  }

 private:
  build::Result<CachedBuild> build(const Asset& asset, const DealtUnit& unit, AssetResult& result) const {
    try {
      build::Stopwatch watch;
      const auto loaded = load(asset, command_.max_memory, result);
      if (!loaded) return tl::unexpected(loaded.error());
      result.read_seconds = watch.lap();
      BuildRequest request = make_request(asset.command(command_), tool_);
      request.options.progress = progress_of(unit);
      const auto shapes = ShapeGeometries::make(pointers(loaded->shapes), command_.threads);
      if (!shapes) return tl::unexpected(shapes.error());
      const std::vector<build::TriangleMesh> meshes = views(loaded->meshes);
      auto built = cache_.build({meshes, shapes->customs()}, request);
      result.build_seconds = watch.lap();
      return built;
    } catch (const std::bad_alloc&) {
      return fail(build::ErrorCode::kOutOfMemory, "not enough memory to build it on one rank");
    }
  }

  static void fill(AssetResult& result, const CachedBuild& built) {
    const build::BuildStatistics& statistics = built.built.bvh.statistics;
    result.state = state_of(built.use);
    result.key = built.key;
    result.file = built.file.string();
    result.bytes = built.built.bvh.buffer.size();
    result.triangles = statistics.triangles;
    result.customs = statistics.customs;
    result.builder_bytes = statistics.scratch_bytes_peak;
    if (!built.damage.empty()) result.warnings.push_back(built.damage + "; it was built again");
    if (const auto dropped = statistics.dropped_not_finite + statistics.dropped_degenerate; dropped != 0)
      result.warnings.push_back("dropped " + std::to_string(dropped) +
                                " primitives that are not finite or have two corners in one place");
  }

  const std::vector<Asset>& assets_;
  const BvhCache& cache_;
  const BuildCommand& command_;
  const std::string& tool_;
};

/// What rank 0 keeps of all assets.
class Overseer {
 public:
  Overseer(Ranks& ranks, const std::vector<Asset>& assets, const FarmEvents& events, FarmReport& report)
      : ranks_(ranks), assets_(assets), events_(events), report_(report), fractions_(assets.size()) {
    for (const Asset& asset : assets) total_ += asset.cost;
  }

  DealEvents deal_events(bool lossy) {
    DealEvents events;
    events.begun = [this](std::size_t unit, int rank) { report_.assets[unit].rank = rank; };
    events.collect = [this](std::size_t unit, int rank, const std::vector<std::byte>& bytes) {
      return collect(unit, rank, bytes);
    };
    events.note = [this](std::size_t unit, int, std::span<const std::byte> bytes) {
      if (bytes.size() == sizeof(double)) std::memcpy(&fractions_[unit], bytes.data(), sizeof(double));
    };
    events.lost = [this, lossy](int rank, std::span<const std::size_t> units) { lose(rank, units, lossy); };
    events.tick = [this] {
      show();
      return !interrupted();
    };
    return events;
  }

 private:
  build::Result<void> collect(std::size_t unit, int rank, std::span<const std::byte> bytes) {
    auto result = unpacked(bytes);
    if (!result) return tl::unexpected(result.error());
    result->rank = rank;
    fractions_[unit] = 1;
    ++done_;
    for (const std::string& warning : result->warnings) events_.warn("asset '" + assets_[unit].name + "': " + warning);
    if (result->state == "failed") events_.warn("asset '" + assets_[unit].name + "' failed: " + result->error);
    report_.assets[unit] = std::move(*result);
    return {};
  }

  void lose(int rank, std::span<const std::size_t> units, bool lossy) {
    std::string text = ranks_.name(rank) + " was lost";
    for (const std::size_t unit : units) {
      text += (unit == units.front() ? " with asset '" : ", '") + assets_[unit].name + "'";
      report_.assets[unit].state = "lost";
      fractions_[unit] = 0;
    }
    events_.warn(text + (lossy ? "; the others go on" : "; the run ends. With --lossy-ranks it would go on"));
  }

  void show() const {
    double sum = 0;
    for (std::size_t i = 0; i < assets_.size(); ++i) sum += fractions_[i] * assets_[i].cost;
    const std::string step = std::to_string(done_) + " of " + std::to_string(assets_.size()) + " assets, " +
                             std::to_string(static_cast<std::size_t>(ranks_.size()) - ranks_.lost().size()) + " ranks";
    if (events_.progress) events_.progress(step.c_str(), total_ > 0 ? sum / total_ : 1);
  }

  Ranks& ranks_;
  const std::vector<Asset>& assets_;
  const FarmEvents& events_;
  FarmReport& report_;
  std::vector<double> fractions_;  ///< How far each asset is.
  std::size_t done_ = 0;
  double total_ = 0;
};

}  // namespace

build::Result<void> run_farm(Ranks& ranks, const std::vector<Asset>& assets, const BvhCache& cache,
                             const BuildCommand& command, const std::string& tool, const FarmEvents& events,
                             FarmReport& report) {
  std::vector<double> costs;
  for (const Asset& asset : assets) costs.push_back(asset.cost);
  report.assets.resize(assets.size());
  build::Stopwatch watch;
  Overseer overseer(ranks, assets, events, report);
  auto dealt = deal(ranks, costs, {.lossy = command.lossy_ranks}, AssetBuilder(assets, cache, command, tool),
                    overseer.deal_events(command.lossy_ranks));
  report.seconds = watch.lap();
  if (!dealt) return tl::unexpected(dealt.error());
  report.lost_ranks = std::move(dealt->lost_ranks);
  return {};
}

unsigned threads_of_rank(const Ranks& ranks, unsigned wanted) {
  if (wanted != 0 || ranks.local_size() == 1) return wanted;
  const auto usable = std::max(1u, std::thread::hardware_concurrency());
  const bool is_bound = static_cast<long>(usable) < ::sysconf(_SC_NPROCESSORS_ONLN);
  return is_bound ? usable : std::max(1u, usable / static_cast<unsigned>(ranks.local_size()));
}

}  // namespace hiprt::tools
