#pragma once
/// Measures speed, faults and errors of subjects on an engine.

#include "engine.h"
#include "record.h"

#include <benchmarks/common/scenes.h>

#include <string>
#include <vector>

namespace hiprt::bench {

/// Parts of the measurement, for --questions. "places" are the instanced spheres.
std::vector<std::string> question_names();

struct SessionOptions {
  std::vector<std::string> questions = question_names();
  unsigned rounds = 7, error_rays = 2000, speed_rays = 1'000'000;
  unsigned aimed_thousands = 1000;  ///< Thousands of rays per check.
  SceneOptions scenes;              ///< For speed.
};

/// @param subjects of the engine; the first one is the reference of the speeds.
build::Result<TradeoffRecord> run_session(Engine& engine, std::vector<Subject> subjects, const SessionOptions& options);

/// Checks the guarantees of Watertight and Reference with Conservative boxes, compiled without fast-math.
/// @return a line per broken guarantee.
std::vector<std::string> broken_guarantees(const TradeoffRecord& record);

}  // namespace hiprt::bench
