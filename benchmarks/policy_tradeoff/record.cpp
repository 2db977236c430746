#include "record.h"

#include <benchmarks/common/rounds.h>
#include <benchmarks/common/summary.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace hiprt::bench {
namespace {

nlohmann::json spread_json(const Spread& spread) {
  return {{"median", spread.median}, {"p999", spread.p999}, {"largest", spread.largest}};
}

/// The keys of the rows without repetitions, in the order of the rows.
template <class Row, class Key> std::vector<std::string> keys(const std::vector<Row>& rows, const Key& key) {
  std::vector<std::string> result;
  for (const Row& row : rows)
    if (const std::string text = key(row); std::find(result.begin(), result.end(), text) == result.end())
      result.push_back(text);
  return result;
}

std::string fault_key(const FaultRow& row) {
  return row.kind + (row.origin.empty() ? "" : ", " + row.origin) + ": " + row.model;
}

/// Count per 10^9 rays, with the digits that are significant.
std::string per_billion(std::uint64_t faults, std::uint64_t rays) {
  if (rays == 0) return "";
  if (faults == 0) return "0";
  const double value = 1e9 * static_cast<double>(faults) / static_cast<double>(rays);
  char text[32];
  std::snprintf(text, sizeof text, value < 1e4 ? "%.0f" : "%.2g", value);
  return text;
}

/// A row per subject, a column per key. @param cell text for a row of the record with that subject and key.
template <class Row>
std::string subject_table(const std::vector<Subject>& subjects, const std::vector<Row>& rows,
                          const std::function<std::string(const Row&)>& key,
                          const std::function<std::string(const Row&)>& cell) {
  std::vector<std::string> names;
  names.reserve(subjects.size());
  for (const Subject& subject : subjects) names.push_back(subject.name);
  return cross_table("policies", names, keys(rows, key), [&](const std::string& name, const std::string& column) {
    const auto found = std::find_if(rows.begin(), rows.end(),
                                    [&](const Row& row) { return row.subject == name && key(row) == column; });
    return found == rows.end() ? std::string() : cell(*found);
  });
}

std::string speed_table(const TradeoffRecord& record) {
  MarkdownTable result({"policies", "triangle test", "box test", "nodes", "compiler", "bytes/triangle",
                        "speed, first = 1", "slowest", "Mrays/s"});
  for (const Subject& subject : record.subjects) {
    std::vector<double> relative, mrays;
    double bytes = 0.0;
    for (const SpeedRow& row : record.speeds)
      if (row.subject == subject.name) {
        relative.push_back(row.relative);
        mrays.push_back(mrays_per_second(row));
        bytes = row.bytes_per_triangle;
      }
    if (relative.empty()) continue;
    result.add({subject.name, subject.triangle, subject.boxes, subject.layout, subject.compiler,
                bytes > 0.0 ? format_number(bytes, 1) : "", format_number(geometric_mean(relative), 3),
                format_number(*std::min_element(relative.begin(), relative.end()), 3),
                format_number(geometric_mean(mrays), 2)});
  }
  return result.text();
}

std::string error_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value >= 1e4 ? "%.1e" : value >= 100 ? "%.0f" : "%.2f", value);
  return text;
}

std::string spread_text(const Spread& spread) {
  return error_number(spread.median) + " / " + error_number(spread.p999) + " / " + error_number(spread.largest);
}

/// A count in 10,000 rays.
std::string per_ten_thousand(std::uint64_t count, const Errors& errors) {
  return format_number(1e4 * static_cast<double>(count) / static_cast<double>(std::max<std::uint64_t>(1, errors.rays)),
                       0);
}

std::string missed_text(const Errors& errors) {
  return per_ten_thousand(errors.missed, errors) + " + " + per_ten_thousand(errors.wrong, errors);
}

std::string error_tables(const TradeoffRecord& record) {
  const std::function key = [](const ErrorRow& row) { return row.name; };
  const auto section = [&](const char* title, const std::function<std::string(const ErrorRow&)>& cell) {
    return std::string(title) + "\n\n" + subject_table<ErrorRow>(record.subjects, record.errors, key, cell);
  };
  const auto spread = [&](const char* title, Spread Errors::*which) {
    return section(title, [which](const ErrorRow& row) {
      const Spread& s = row.errors.*which;
      if (row.errors.missed + row.errors.other >= row.errors.rays) return std::string();
      return spread_text(s);
    });
  };
  return section("Per 10,000 rays that hit in exact arithmetic: misses + another surface (t differs by more than 1 %)",
                 [](const ErrorRow& row) { return missed_text(row.errors); }) +
         section("Per 10,000: another triangle than the closest one",
                 [](const ErrorRow& row) { return per_ten_thousand(row.errors.other, row.errors); }) +
         spread("Error of t, in units in the last place: median / 99.9th percentile / largest", &Errors::t) +
         spread("Error of u, in units of 2^-24: median / 99.9th percentile / largest", &Errors::u) +
         spread(
             "Distance of the hit point from the triangle's plane, in units in the last place of the largest "
             "coordinate: median / 99.9th percentile / largest",
             &Errors::point) +
         section("Hit points farther from the plane than Hit::error",
                 [&](const ErrorRow& row) { return std::to_string(row.errors.beyond_bound); });
}

std::string instance_tables(const TradeoffRecord& record) {
  const auto section = [&](const char* title, const std::function<std::string(const InstancedRow&)>& cell) {
    return std::string(title) + "\n\n" +
           subject_table<InstancedRow>(
               record.subjects, record.spheres, [](const InstancedRow& row) { return row.sphere; }, cell);
  };
  return section("Speed relative to the same mesh, transformed, without instances",
                 [](const InstancedRow& row) { return format_number(row.relative, 3); }) +
         section("Per 10,000 rays that hit in exact arithmetic: misses + another surface",
                 [](const InstancedRow& row) { return missed_text(row.errors); }) +
         section("Error of t, in units in the last place: median / 99.9th percentile / largest",
                 [](const InstancedRow& row) { return spread_text(row.errors.t); }) +
         section(
             "Displacement: distance of the hit point from the triangle's plane, in units in the last place of the "
             "largest coordinate: median / 99.9th percentile / largest",
             [](const InstancedRow& row) { return spread_text(row.errors.point); }) +
         section("Hit points farther from the plane than Hit::error",
                 [&](const InstancedRow& row) {
                   return row.spawned == 0 ? std::string() : std::to_string(row.errors.beyond_bound);
                 }) +
         section("Spawned rays, per 10^9: self-intersections + misses", [](const InstancedRow& row) {
           const std::uint64_t rays = row.spawned - row.tally.skipped;
           if (row.spawned == 0) return std::string();
           return per_billion(row.tally.faults, rays) + " + " + per_billion(row.tally.lost, rays);
         });
}

}  // namespace

double mrays_per_second(const SpeedRow& row) { return 1e-6 * static_cast<double>(row.count) / median(row.seconds); }

void add_json(const TradeoffRecord& record, nlohmann::json& json) {
  for (const char* name : {"subjects", "speed", "faults", "errors", "places"}) json[name] = nlohmann::json::array();
  for (const Subject& subject : record.subjects)
    json["subjects"].push_back({{"name", subject.name},
                                {"triangle", subject.triangle},
                                {"boxes", subject.boxes},
                                {"layout", subject.layout},
                                {"compiler", subject.compiler}});
  for (const SpeedRow& row : record.speeds)
    json["speed"].push_back({{"subject", row.subject},
                             {"scene", row.scene},
                             {"rays", row.rays},
                             {"count", row.count},
                             {"seconds", row.seconds},
                             {"mrays_per_second", mrays_per_second(row)},
                             {"relative", row.relative},
                             {"bytes_per_triangle", row.bytes_per_triangle}});
  for (const FaultRow& row : record.faults)
    json["faults"].push_back({{"subject", row.subject},
                              {"model", row.model},
                              {"question", row.kind},
                              {"origin", row.origin},
                              {"rays", row.rays - row.tally.skipped},
                              {"faults", row.tally.faults},
                              {"lost", row.tally.lost},
                              {"folded", row.tally.folded}});
  for (const ErrorRow& row : record.errors)
    json["errors"].push_back({{"subject", row.subject},
                              {"case", row.name},
                              {"rays", row.errors.rays},
                              {"missed", row.errors.missed},
                              {"wrong_surface", row.errors.wrong},
                              {"other_triangle", row.errors.other},
                              {"t", spread_json(row.errors.t)},
                              {"u", spread_json(row.errors.u)},
                              {"v", spread_json(row.errors.v)},
                              {"point", spread_json(row.errors.point)},
                              {"beyond_bound", row.errors.beyond_bound}});
  for (const InstancedRow& row : record.spheres)
    json["places"].push_back({{"subject", row.subject},
                              {"place", row.sphere},
                              {"relative", row.relative},
                              {"rays", row.errors.rays},
                              {"missed", row.errors.missed},
                              {"wrong_surface", row.errors.wrong},
                              {"t", spread_json(row.errors.t)},
                              {"point", spread_json(row.errors.point)},
                              {"beyond_bound", row.errors.beyond_bound},
                              {"spawned", row.spawned - row.tally.skipped},
                              {"self_intersections", row.tally.faults},
                              {"lost", row.tally.lost}});
}

std::string to_markdown(const TradeoffRecord& record) {
  std::vector<FaultRow> aimed, spawned;
  for (const FaultRow& row : record.faults) (row.kind == "spawned" ? spawned : aimed).push_back(row);
  std::string text;
  if (!record.speeds.empty()) text += "## Speed\n\n" + speed_table(record);
  if (!aimed.empty())
    text +=
        "## Faults per 10^9 rays\n\nRandom, edges, vertices: rays from inside that leak out. Boxes: hits that boxes "
        "hide.\n\n" +
        subject_table<FaultRow>(record.subjects, aimed, fault_key, [](const FaultRow& row) {
          return per_billion(row.tally.faults, row.rays - row.tally.skipped);
        });
  if (!spawned.empty())
    text +=
        "## Spawned rays, per 10^9\n\nSelf-intersections + rays that miss the closed mesh around them. A third number "
        "counts rays that miss because they start within the error bound of a fold of the mesh.\n\n" +
        subject_table<FaultRow>(record.subjects, spawned, fault_key, [](const FaultRow& row) {
          const std::uint64_t rays = row.rays - row.tally.skipped;
          const std::string folded = row.origin == "spawn_origin" ? " + " + per_billion(row.tally.folded, rays) : "";
          return per_billion(row.tally.faults, rays) + " + " + per_billion(row.tally.lost, rays) + folded;
        });
  if (!record.errors.empty())
    text += "## Errors\n\nClosest hits compared with exact arithmetic. All node layouts have the same hits.\n\n" +
            error_tables(record);
  if (!record.spheres.empty())
    text +=
        "## Instances and motion\n\nA sphere of 5,120 triangles through instances, and between two keys. The exact "
        "surface follows from the given matrices and keys.\n\n" +
        instance_tables(record);
  return text;
}

}  // namespace hiprt::bench
