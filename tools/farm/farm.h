#pragma once
/// Builds the assets of a manifest into a cache, on all ranks of a run.

#include <tools/base/progress_sink.h>
#include <tools/build/bvh_cache.h>
#include <tools/farm/farm_report.h>

#include <functional>

namespace hiprt::tools {

struct FarmEvents {
  /// "12 of 100 assets" and the finished fraction of all costs. On rank 0.
  ProgressSink progress{};
  /// A warning of an asset, or of a lost rank. On rank 0.
  std::function<void(const std::string&)> warn{};
};

/// Every rank makes this call. Rank 0 builds, too.
/// @param command its options are the defaults of the assets. @param tool for provenance. @param report filled on
/// rank 0, also when an error is returned.
/// @return the error that ended the run early: kIo if the cache cannot be written, kCancelled, kBackend if rank 0 is
/// lost. Assets that failed are in the report.
build::Result<void> run_farm(Ranks& ranks, const std::vector<Asset>& assets, const BvhCache& cache,
                             const BuildCommand& command, const std::string& tool, const FarmEvents& events,
                             FarmReport& report);

/// Threads of one rank: --threads, or the processors that this rank may use. Ranks of one machine share them, unless
/// mpirun has bound each rank to its own.
unsigned threads_of_rank(const Ranks& ranks, unsigned wanted);

}  // namespace hiprt::tools
