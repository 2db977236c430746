#include <tools/farm/farm_command.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/parallel.h>
#include <tools/base/read_input.h>
#include <tools/cli/progress.h>
#include <tools/cli/report.h>
#include <tools/distributed/broadcast.h>
#include <tools/distributed/process.h>
#include <tools/farm/farm.h>

#include <iostream>
#include <numeric>
#include <utility>

namespace hiprt::tools {
namespace {

/// The manifest as rank 0 has read it: all ranks must number the assets in the same way.
build::Result<std::vector<Asset>> read_manifest(const std::string& path, Ranks& ranks) {
  SharedBytes bytes = std::make_shared<const std::vector<std::byte>>();
  build::Result<std::vector<Asset>> assets;
  if (ranks.is_first()) {
    const auto file = read_input(path);
    if (!file) return tl::unexpected(file.error());
    bytes = std::make_shared<const std::vector<std::byte>>(file->bytes().begin(), file->bytes().end());
  }
  std::vector<int> all(static_cast<std::size_t>(ranks.size()));
  std::iota(all.begin(), all.end(), 0);
  const auto shared = broadcast(ranks, std::move(bytes), all);
  if (!shared) return tl::unexpected(shared.error());
  assets = parse_manifest({reinterpret_cast<const char*>((*shared)->data()), (*shared)->size()}, path);
  if (!assets || !ranks.is_first()) return assets;
  if (auto measured = measure_assets(*assets, path); !measured) return tl::unexpected(measured.error());
  return assets;
}

build::Result<void> build_assets(const Cli& cli, const BuildCommand& given, const std::string& tool, Ranks& ranks,
                                 ProgressBar& bar) {
  BuildCommand command = given;
  command.threads = threads_of_rank(ranks, given.threads);
  const ThreadLimit limit(command.threads);
  const auto assets = read_manifest(command.manifest, ranks);
  if (!assets) return tl::unexpected(assets.error());
  const auto cache = BvhCache::open(command.cache);
  if (!cache) return tl::unexpected(cache.error());
  if (ranks.is_first()) cache->clean();
  FarmReport report;
  FarmEvents events;
  events.progress = bar.sink();
  events.warn = [&](const std::string& text) {
    bar.clear();
    cli.warn(text);
  };
  auto ran = run_farm(ranks, *assets, *cache, command, tool, events, report);
  bar.clear();
  if (!ranks.is_first()) return ran;
  if (!ranks.lost().empty()) cache->clean();
  if (cli.json())
    cli.print(report_json(report, *assets, ranks));
  else if (command.stats)
    std::cout << report_text(report, *assets, ranks);
  if (!ran) return ran;
  if (const std::string fault = report.fault(*assets); !fault.empty()) return fail(build::ErrorCode::kBackend, fault);
  return {};
}

build::Result<void> prune(const Cli& cli, const BuildCommand& command) {
  const auto pruned = prune_cache(command.cache, *parse_prune_limit(command.prune));
  if (!pruned) return tl::unexpected(pruned.error());
  if (cli.json() && command.manifest.empty())
    cli.print({{"removed", {{"files", pruned->files}, {"bytes", pruned->bytes}}},
               {"kept", {{"files", pruned->kept_files}, {"bytes", pruned->kept_bytes}, {"in_use", pruned->in_use}}}});
  else if (!cli.json())
    std::cout << command.cache << ": removed " << pruned->files << " files, " << bytes_text(pruned->bytes) << "; "
              << pruned->kept_files << " are left, " << bytes_text(pruned->kept_bytes) << "; in use: " << pruned->in_use
              << "\n";
  return {};
}

}  // namespace

build::Result<void> run_farm_command(const Cli& cli, const BuildCommand& command, const std::string& tool,
                                     Ranks& ranks) {
  const InterruptGuard guard;
  ProgressBar bar(ranks.is_first() && (stderr_is_terminal() || (ranks.size() > 1 && parent_shows_terminal())));
  if (!command.manifest.empty()) {
    auto built = build_assets(cli, command, tool, ranks, bar);
    // Rank 0 says why it has stopped the others.
    if (!built && !ranks.is_first() && built.error().code == build::ErrorCode::kCancelled) return {};
    if (!built) return built;
  }
  if (!command.prune.empty() && ranks.is_first()) return prune(cli, command);
  return {};
}

}  // namespace hiprt::tools
