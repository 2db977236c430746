#pragma once
/// A thread that follows paths in a simulated run of a scene in parts.

#include "part_messages.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace hiprt::bench {

/// Some paths of a tile.
struct Wave {
  const PathCalls* calls;
  double times;  ///< Its paths divided by those of the calls.
};

/// @param unit one tile, or several of a row. @param most paths of a wave.
inline std::vector<Wave> waves_of(const PartPictureCosts& picture, const tools::PictureUnit& unit, double most) {
  const tools::PictureGrid& grid = picture.grid;
  std::vector<Wave> waves;
  const std::uint32_t first = unit.top / grid.tile * grid.columns() + unit.left / grid.tile;
  for (std::uint32_t x = 0; x * grid.tile < unit.width; ++x) {
    const double paths = static_cast<double>(grid.unit(first + x, 1, 0, 1).pixels()) * unit.steps;
    const double count = std::ceil(paths / most);
    const PathCalls& calls = picture.calls[picture.calls_of_tile[first + x]];
    waves.insert(waves.end(), static_cast<std::size_t>(count), Wave{&calls, paths / count / calls.paths});
  }
  return waves;
}

enum class Phase : std::uint8_t { kIdle, kBetween, kSending, kVisiting, kTaking, kWaiting, kEnding };

struct Worker {
  unsigned rank = 0;
  Phase phase = Phase::kIdle;
  tools::PictureUnit unit{};
  double began = 0.0;
  std::vector<Wave> waves{};
  std::size_t wave = 0, call = 0;
  std::map<std::uint16_t, std::vector<Walk>> ready{};  ///< By part.
  unsigned out = 0;                                    ///< Questions without answers.
  std::vector<std::uint32_t> answers{};
  std::vector<std::uint32_t> leaving{};  ///< Questions that are being encoded.
  std::vector<std::uint32_t> taken{};    ///< Answers that are being decoded.
  std::vector<Walk> visiting{};          ///< Rays in parts that its rank has.

  const TraceCall& now() const { return waves[wave].calls->calls[call]; }
};

}  // namespace hiprt::bench
