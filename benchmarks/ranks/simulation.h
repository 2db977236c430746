#pragma once
/// A run of bvhrender on many ranks in simulated time: the real dealer of units, made-up ranks, network and processor
/// times. A discrete-event simulation.

#include <tools/render/units/picture_state.h>

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// What a picture costs.
struct PictureCosts {
  tools::PictureGrid grid;
  std::uint32_t steps = 1;
  std::size_t pixel_bytes = 32;
  std::vector<double> tile_seconds;  ///< Of one step of a tile on one worker, row by row; grid.tiles() of them.
  /// Standard deviation of the logarithm of a step's time. Steps are independent: the sum of n has 1 / sqrt(n) of it.
  double deviation = 0.0;
};

/// What rank 0 and the network cost.
struct RankCosts {
  double unit_seconds = 0.0;      ///< Of rank 0's dealing thread, for each unit: out and back.
  double byte_seconds = 0.0;      ///< The same for each byte of a unit's state, in one direction.
  double rank_seconds = 0.0;      ///< The same for each unit and rank of the run.
  double message_seconds = 0.0;   ///< Of rank 0's thread that calls MPI, for each message. It is another thread.
  double tick = 0.001;            ///< Results of other ranks wait until the dealing thread looks, at most this long.
  double latency = 0.0;           ///< Seconds of a message.
  double byte_per_second = 1e12;  ///< Of rank 0's network card, in each direction.
};

struct SimulatedRun {
  double seconds = 0.0;    ///< From the first unit dealt to the last result taken.
  double worked = 0.0;     ///< Seconds of all workers together.
  double dealing = 0.0;    ///< Seconds in which rank 0's dealing thread is busy.
  double messaging = 0.0;  ///< Seconds in which rank 0's thread that calls MPI is busy.
  double card = 0.0;       ///< Seconds in which rank 0's card receives or sends, whichever is more.
  std::uint64_t units = 0;
  std::uint64_t bytes = 0;  ///< Of states, in both directions, between ranks.
};

/// @param workers of each rank, 1 or more. Rank 0 also deals, in a separate thread.
/// @param seed of the units' times.
SimulatedRun simulate(const PictureCosts& picture, const RankCosts& costs, unsigned ranks, unsigned workers,
                      std::uint64_t seed);

/// @return a lower bound of the run's seconds: the longest of the times of the workers, of rank 0's two threads and of
/// its network card.
double least_seconds(const SimulatedRun& run, unsigned ranks, unsigned workers);

}  // namespace hiprt::bench
