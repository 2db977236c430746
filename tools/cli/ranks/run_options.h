#pragma once
/// Options of long work: in several runs, and in several processes.

#include <cstdint>
#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

/// Their group in --help.
inline constexpr const char* kRanksGroup = "Several processes (mpirun)";

/// Options of work that is done in several runs.
struct ResumeOptions {
  std::string file;     ///< Checkpoint; empty: none.
  double seconds = 30;  ///< Between two writes of it.
};

/// Options of runs of several processes.
struct RankFlags {
  bool lossy = false;                                   ///< Go on without ranks that were lost.
  bool broadcast = false;                               ///< Only rank 0 reads the BVH file.
  std::uint64_t ray_memory = std::uint64_t{256} << 20;  ///< Of scenes in parts: bytes of the rays of a rank.
};

/// Adds --resume and --resume-every. @param text what --resume does.
void add_resume_options(CLI::App& app, ResumeOptions& resume, const std::string& text);
/// Adds --broadcast and --lossy-ranks.
void add_rank_options(CLI::App& app, RankFlags& ranks);

/// The end of a message about unfinished work: how to go on. Empty without --resume.
std::string resume_hint(const ResumeOptions& resume);

}  // namespace hiprt::tools
