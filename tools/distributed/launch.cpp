#include <tools/distributed/launch.h>

#include <tools/base/text.h>

#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <string_view>

namespace hiprt::tools {
namespace {

/// @return the number of the first variable that holds one.
std::optional<int> number_of(std::initializer_list<const char*> variables) {
  for (const char* variable : variables) {
    const char* text = std::getenv(variable);
    const auto value = text == nullptr ? std::nullopt : parse_integer(text);
    if (value && *value >= 0 && *value <= std::numeric_limits<int>::max()) return static_cast<int>(*value);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Launch> launch_of_environment() {
  // SLURM_* alone means nothing: a batch script has them, too, and is not started through PMI.
  const auto rank = number_of({"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"});
  if (!rank) return std::nullopt;
  const auto size = number_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"});
  return Launch{*rank, size.value_or(0)};
}

std::string recovery_words() {
  constexpr std::string_view kOpenMpi = "Open MPI ";
  constexpr int kFirstWithUlfm = 5;  // User-level failure mitigation, as mpirun calls it.
  const std::string mpi = mpi_summary();
  if (!mpi.starts_with(kOpenMpi)) return "--enable-recovery";
  const std::string_view version = std::string_view(mpi).substr(kOpenMpi.size());
  const auto number = parse_integer(version.substr(0, version.find('.')));
  return number && *number >= kFirstWithUlfm ? "--with-ft ulfm" : "--enable-recovery";
}

bool is_first_of_launch() {
  const auto launch = launch_of_environment();
  return !launch || launch->rank == 0;
}

}  // namespace hiprt::tools
