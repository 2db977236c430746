#pragma once
/// The ranks of a tool's run.

#include <tools/distributed/ranks.h>

#include <memory>

namespace hiprt::tools {

class Cli;

/// Joins the other ranks if mpirun has started several. The end of main() is leave_run(ranks.get(), status).
/// @param lossy whether the run goes on without lost ranks. Rank 0 warns if mpirun will not let it.
/// @param ranks gets this process, also if it is alone.
build::Result<void> join_ranks(const Cli& cli, bool lossy, std::unique_ptr<Ranks>& ranks);

}  // namespace hiprt::tools
