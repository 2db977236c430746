#include <tools/cli/ranks/run_options.h>

#include <CLI/CLI.hpp>

namespace hiprt::tools {

void add_resume_options(CLI::App& app, ResumeOptions& resume, const std::string& text) {
  constexpr const char* kGroup = "Long runs";
  auto* const file = app.add_option("--resume", resume.file, text)->type_name("FILE")->group(kGroup);
  app.add_option("--resume-every", resume.seconds, "Seconds between two writes of that file, at least")
      ->check(CLI::Range(0.0, 86400.0))
      ->needs(file)
      ->type_name("S")
      ->capture_default_str()
      ->group(kGroup);
}

void add_rank_options(CLI::App& app, RankFlags& ranks) {
  app.add_flag("--broadcast", ranks.broadcast,
               "Only rank 0 reads the BVH file and sends it to the others, which need no disk with it")
      ->disable_flag_override()
      ->group(kRanksGroup);
  app.add_flag("--lossy-ranks", ranks.lossy,
               "Go on when a rank is lost: its work is dealt again, and the results are the same. Start mpirun with "
               "--enable-recovery then (Open MPI 5 and newer: --with-ft ulfm). Default: the run ends")
      ->disable_flag_override()
      ->group(kRanksGroup);
}

std::string resume_hint(const ResumeOptions& resume) {
  return resume.file.empty() ? std::string() : "; run the same command again to go on from " + resume.file;
}

}  // namespace hiprt::tools
