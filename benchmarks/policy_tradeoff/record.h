#pragma once
/// The measurements, as JSON and as tables.

#include "errors.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

inline constexpr const char* kTradeoffFormat = "hiprt bench_tradeoff 1";

struct SpeedRow {
  std::string subject, scene, rays;
  std::uint64_t count = 0;      ///< Rays.
  std::vector<double> seconds;  ///< By round.
  double relative = 0.0;        ///< Speed relative to the first subject, median over the rounds.
  double bytes_per_triangle = 0.0;
};

/// One check with a number of rays.
struct FaultRow {
  std::string subject, model;
  std::string kind;    ///< "random", "edges", "vertices", "boxes", "spawned".
  std::string origin;  ///< Of spawned rays: "spawn_origin", "tmin 0", "tmin 1e-4", ...
  std::uint64_t rays = 0;
  Tally tally;
};

struct ErrorRow {
  std::string subject, name;
  Errors errors;
};

/// One instanced sphere.
struct InstancedRow {
  std::string subject, sphere;
  double relative = 0.0;  ///< Speed relative to the same mesh, transformed, without instances.
  Errors errors;          ///< t, point, missed, wrong and beyond_bound.
  std::uint64_t spawned = 0;
  Tally tally;  ///< Of the spawned rays.
};

struct TradeoffRecord {
  std::vector<Subject> subjects;
  std::vector<SpeedRow> speeds;
  std::vector<FaultRow> faults;
  std::vector<ErrorRow> errors;
  std::vector<InstancedRow> spheres;
};

/// 10^6 rays per second, median over the rounds.
double mrays_per_second(const SpeedRow& row);

/// Adds "subjects", "speed", "faults", "errors" and "places".
void add_json(const TradeoffRecord& record, nlohmann::json& json);

/// Tables of speed, faults and errors.
std::string to_markdown(const TradeoffRecord& record);

}  // namespace hiprt::bench
