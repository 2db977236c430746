#pragma once
/// How this process was started: alone, or as one of the processes of mpirun or Slurm.

#include <optional>
#include <string>

namespace hiprt::tools {

/// What a launcher says of a process that it started.
struct Launch {
  int rank = 0;  ///< Number of the process, from 0.
  int size = 0;  ///< Count of processes; 0: the launcher does not say.
};

/// Reads the environment variables of Open MPI's mpirun, of PMIx and of PMI. It does not call MPI.
/// @return nothing for a program that was started alone.
std::optional<Launch> launch_of_environment();

/// Whether messages that all processes of a run would print are this one's: true for rank 0, and for a program that was
/// started alone.
bool is_first_of_launch();

/// @return the words that make mpirun go on after the end of a rank. They depend on the version of Open MPI.
std::string recovery_words();

/// @return "Open MPI 4.1.4", or "not compiled in (reason)". It does not start MPI.
std::string mpi_summary();

}  // namespace hiprt::tools
