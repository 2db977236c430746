#pragma once
/// bvhquery as a user runs it, with the files read by offsets as --help describes them.

#include "json_result.h"
#include "programs.h"

#include <tools/scene_io/query_file.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

inline const std::string kBvhQuery = HIPRT_BVHQUERY;

/// A result file. Records are PointRecord or numbers, by `width`.
struct ResultFile {
  std::uint32_t count = 0, each = 0;
  std::vector<std::uint64_t> first;  ///< Of lists.
  std::vector<tools::PointRecord> points;
  std::vector<std::uint32_t> numbers;

  ResultFile(const std::string& bytes, std::size_t width) {
    REQUIRE(bytes.size() >= 8);
    std::memcpy(&count, bytes.data(), 4);
    std::memcpy(&each, bytes.data() + 4, 4);
    std::size_t at = 8, records = std::size_t{count} * each;
    if (each == 0) {
      first.resize(std::size_t{count} + 1);
      REQUIRE(bytes.size() >= 8 + first.size() * 8);
      std::memcpy(first.data(), bytes.data() + at, first.size() * 8);
      at += first.size() * 8;
      records = first.back();
    }
    REQUIRE(bytes.size() == at + records * width);
    void* const to = width == 32 ? (points.resize(records), static_cast<void*>(points.data()))
                                 : (numbers.resize(records), static_cast<void*>(numbers.data()));
    if (records != 0) std::memcpy(to, bytes.data() + at, records * width);
  }
  /// The numbers of a list.
  std::vector<std::uint32_t> list(std::size_t i) const {
    return {numbers.begin() + static_cast<std::ptrdiff_t>(first.at(i)),
            numbers.begin() + static_cast<std::ptrdiff_t>(first.at(i + 1))};
  }
};

/// Queries of one scene in one folder.
class QueryRuns {
 public:
  QueryRuns(const TempFolder& folder, std::string scene) : folder_(folder), scene_(std::move(scene)) {}

  void points(const std::vector<float>& values) { write(tools::QueryShape::kPoint, values); }
  void spheres(const std::vector<float>& values) { write(tools::QueryShape::kSphere, values); }
  void boxes(const std::vector<float>& values) { write(tools::QueryShape::kBox, values); }

  /// The command line for the shape that was written last.
  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> words{kBvhQuery, scene_, input_, folder_ / "in.queries", "-o", folder_ / "out.results"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  ResultFile ask(const std::string& query, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--query", query, "--json"});
    summary = json_of(run(command(more)));
    CHECK(summary["query"] == query);
    const bool numbers = query == "inside" || query == "overlaps" || query == "any-overlap";
    return {read_file(folder_ / "out.results"), numbers ? std::size_t{4} : std::size_t{32}};
  }

  nlohmann::json summary;

 private:
  void write(tools::QueryShape shape, const std::vector<float>& values) {
    input_ = std::string("--") + tools::plural(shape);
    const auto written = tools::write_queries(folder_ / "in.queries", {shape, values});
    INFO((written ? std::string() : written.error().message));
    REQUIRE(written.has_value());
  }

  const TempFolder& folder_;
  std::string scene_, input_;
};

}  // namespace hiprt::test
