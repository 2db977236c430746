#pragma once
/// What the programs have in common that predict runs on many ranks.

#include <hiprt_build/error.h>
#include <tools/distributed/ranks.h>

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// Exit status of these programs.
inline constexpr int kFailure = 1, kUsage = 2;

/// @param words of --ranks.
/// @return the numbers of ranks; kInvalidInput if a word is no number from 1 to @p most.
build::Result<std::vector<unsigned>> parse_ranks(const std::vector<std::string>& words, unsigned most);

/// Runs a program that mpirun may have started.
/// @param fail prints an error and returns the status that it is given.
/// @param measure called on all ranks. @param predict called on the first one afterwards.
/// @return the exit status: that of predict(), or kFailure.
int run_on_ranks(const std::function<int(const std::string& message, int status)>& fail,
                 const std::function<build::Result<void>(tools::Ranks&)>& measure, const std::function<int()>& predict);

}  // namespace hiprt::bench
