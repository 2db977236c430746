#include <tools/cli/ranks/join_ranks.h>

#include <tools/cli/cli.h>

#include <string>
#include <utility>

namespace hiprt::tools {

build::Result<void> join_ranks(const Cli& cli, bool lossy, std::unique_ptr<Ranks>& ranks) {
  auto joined = Ranks::join({.lossy = lossy});
  if (!joined) return tl::unexpected(std::move(joined.error()));
  ranks = std::move(*joined);
  const std::string warning = recovery_warning();
  if (lossy && ranks->is_first() && !warning.empty()) cli.warn(warning);
  return {};
}

}  // namespace hiprt::tools
