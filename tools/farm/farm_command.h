#pragma once
/// bvhbuild --manifest and --prune.

#include <tools/cli/build/build_command.h>
#include <tools/cli/cli.h>
#include <tools/distributed/ranks.h>

#include <string>

namespace hiprt::tools {

/// Builds the assets, then prunes the cache, as far as the command line says. Every rank makes this call; rank 0
/// prints.
/// @return on rank 0 kBackend if an asset was not built.
build::Result<void> run_farm_command(const Cli& cli, const BuildCommand& command, const std::string& tool,
                                     Ranks& ranks);

}  // namespace hiprt::tools
