#pragma once
/// A run of bvhrender of a scene in parts on many ranks, in simulated time. It has the real dealer of units. Rays visit
/// the parts that measured rays have visited. A discrete-event simulation.
///
/// A core works on what is most urgent: the thread that calls MPI, then threads that answer questions, then workers
/// that follow paths. A rank has two workers per core: one waits for answers while the other computes.

#include <tools/render/units/picture_state.h>

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// Rays that visit the same parts in the same order.
struct RayTours {
  std::vector<std::uint16_t> parts;
  double rays = 0.0;
};

/// Visits of the rays of one call to one part.
struct PartVisits {
  std::uint16_t part = 0;
  double seconds = 0.0;  ///< Of a ray.
  double hits = 0.0;     ///< Surfaces in the answer, per ray.
};

/// One call of PartExchange::trace().
struct TraceCall {
  double seconds = 0.0;  ///< Of the thread that has the rays, before and during the call, without visits.
  double rays = 0.0;
  std::vector<RayTours> tours;     ///< Without rays that visit no part.
  std::vector<PartVisits> visits;  ///< In the order of the parts.
};

/// The calls for some paths, one after the other.
struct PathCalls {
  double paths = 0.0;
  std::vector<TraceCall> calls;
  double seconds = 0.0;  ///< After the last call.
};

/// What a picture costs.
struct PartPictureCosts {
  tools::PictureGrid grid;
  std::uint32_t steps = 1, levels = 1;
  std::size_t pixel_bytes = 32;
  std::vector<std::uint32_t> calls_of_tile;  ///< Which of `calls` a tile has, row by row.
  std::vector<PathCalls> calls;
};

/// What messages between ranks cost.
struct ExchangeCosts {
  double home_ray = 0.0, home_hit = 0.0;    ///< Of the asking thread, per ray and per surface: encodes and decodes.
  double owner_ray = 0.0, owner_hit = 0.0;  ///< The same of the answering thread.
  double parcel = 0.0;                      ///< Of a visit of any number of rays, beside the seconds of each ray.
  double message_seconds = 0.0;   ///< Of a rank's core, for each message out or in, with its context switches.
  double message_byte = 0.0;      ///< The same for each byte.
  double waiting = 0.0;           ///< Part of a core of each rank that looking for messages takes.
  double unit_seconds = 0.0;      ///< Of rank 0's dealing thread, for each unit: out and back.
  double latency = 0.0;           ///< Seconds of a message between two threads for MPI.
  double byte_per_second = 1e12;  ///< Of each rank's network card, in each direction.
};

/// How a run is started.
struct PartRun {
  std::vector<unsigned> owner;      ///< Rank of each part (owners_of()).
  unsigned ranks = 1, threads = 1;  ///< Threads of each rank.
  double wave_paths = 65536.0;      ///< Most paths of a wave (RayMemory).
  double credit = 1e6;              ///< Most rays of a rank on their way to another one (RayMemory), at least 1.
  std::uint64_t seed = 36;          ///< Of the numbers of rays, which are rounded up or down.
};

struct SimulatedPartRun {
  double seconds = 0.0;   ///< From the first unit dealt to the last result taken.
  double worked = 0.0;    ///< Seconds of all cores together.
  double busiest = 0.0;   ///< Seconds of the cores of the rank that has most for MPI and for answers, on all its cores.
  double card = 0.0;      ///< The most seconds in which a rank's card receives or sends.
  double rays = 0.0;      ///< Traced.
  double sent = 0.0;      ///< Visits of rays to parts of other ranks.
  double messages = 0.0;  ///< With such rays, and with the answers.
  double bytes = 0.0;     ///< Of these messages.
};

SimulatedPartRun simulate(const PartPictureCosts& picture, const ExchangeCosts& costs, const PartRun& run);

/// @return seconds of the picture on one worker that has all parts.
double seconds_alone(const PartPictureCosts& picture);

/// @return a lower bound of the run's seconds.
double least_seconds(const SimulatedPartRun& simulated, const PartRun& run);

}  // namespace hiprt::bench
