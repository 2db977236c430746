#pragma once
/// Command lines that write files: those of all tools, on small inputs.

#include <tests/oracle/random.h>
#include <tests/tools/programs.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace hiprt::checks {

/// Contents by name.
using Contents = std::map<std::string, std::string>;

struct ProgramLine {
  std::vector<std::string> outputs;  ///< Names, in the order in which they are written.
  /// @param in, out of folders, with a slash behind them.
  std::function<std::vector<std::string>(const std::string& in, const std::string& out)> words;
};

inline std::vector<ProgramLine> program_lines() {
  using Words = std::vector<std::string>;
  using Text = const std::string&;
  const std::string query = HIPRT_BVHQUERY, render = HIPRT_BVHRENDER;
  return {
      {{"a.bvh"},
       [](Text in, Text out) -> Words {
         return {test::kBvhBuild, in + "a.obj", "-o", out + "a.bvh"};
       }},
      {{"s.bvh"},
       [](Text in, Text out) -> Words {
         return {test::kBvhBuild, in + "s.json", "-o", out + "s.bvh"};
       }},
      {{"r.bvh"},
       [](Text in, Text out) -> Words {
         return {test::kBvhBuild, in + "a.bvh", "--refit", in + "moved.obj", "-o", out + "r.bvh"};
       }},
      {{"p.0.bvh", "p.0.data", "p.1.bvh", "p.1.data", "p.json"},
       [](Text in, Text out) -> Words {
         return {test::kBvhBuild, in + "s.json", "--parts", "2", "-o", out + "p.json"};
       }},
      {{"new.bvh"},
       [](Text in, Text out) -> Words {
         return {test::kBvhInfo, "--upgrade", in + "old.bvh", out + "new.bvh"};
       }},
      {{"tree.json"},
       [](Text in, Text out) -> Words {
         return {test::kBvhInfo, in + "a.bvh", "--export", out + "tree.json"};
       }},
      {{"a.hits"},
       [](Text in, Text out) -> Words {
         return {test::kBvhTrace, in + "a.bvh", "--rays", in + "a.rays", "--hits", out + "a.hits"};
       }},
      // In blocks, which go to a file of another name first: b.hits.part.
      {{"b.hits"},
       [](Text in, Text out) -> Words {
         return {test::kBvhTrace, in + "a.bvh", "--rays", in + "a.rays", "--block", "3000", "--hits", out + "b.hits"};
       }},
      {{"a.png"},
       [=](Text in, Text out) -> Words { return {render, in + "a.bvh", "-o", out + "a.png", "--size", "160x120"}; }},
      {{"a.exr"},
       [=](Text in, Text out) -> Words { return {render, in + "a.bvh", "-o", out + "a.exr", "--size", "160x120"}; }},
      {{"a.results"},
       [=](Text in, Text out) -> Words {
         return {query, in + "a.bvh", "--points", in + "a.points", "-o", out + "a.results"};
       }},
  };
}

/// Inputs of all lines.
class ProgramInputs {
 public:
  /// @param version 0 and 1 have different outputs.
  explicit ProgramInputs(unsigned version) {
    const unsigned n = 60 + 4 * version;
    folder_.write("a.obj", test::grid_obj(n));
    folder_.write("moved.obj", test::grid_obj(n, 2));
    folder_.write("s.json", R"({"format": "hiprt scene", "version": 1, "scene": "g", "objects": {"a": ["a.obj"]},
 "groups": {"g": [{"object": "a"}, {"object": "a", "translate": [90, 0, 0]},
                  {"object": "a", "translate": [0, 90, 1]}]}})");
    std::filesystem::copy_file(
        std::string(HIPRT_VERSIONS_FOLDER) + (version == 0 ? "/1.3/nested.bvh" : "/1.3/instances.bvh"),
        folder_ / "old.bvh");
    constexpr std::uint32_t kCount = 20000;
    oracle::Random random(version);
    std::string rays, points;
    test::append(rays, kCount, 0u);
    test::append(points, kCount, 3u);
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const float x = random.uniform_float(0, 20), y = random.uniform_float(0, 20);
      test::append(rays, x, y, 5.0f, 0.0f, 0.0f, 0.0f, -1.0f, 100.0f);
      test::append(points, x, y, 5.0f);
    }
    folder_.write("a.rays", rays);
    folder_.write("a.points", points);
    test::check_good(test::run({test::kBvhBuild, at() + "a.obj", "-o", at() + "a.bvh"}));
  }

  std::string at() const { return folder_.path().string() + "/"; }

 private:
  test::TempFolder folder_;
};

inline Contents contents_of(const test::TempFolder& folder) {
  Contents contents;
  for (const std::string& name : folder.names()) contents[name] = test::read_file(folder / name);
  return contents;
}

/// @return the outputs of a line.
inline Contents outputs_of(const ProgramLine& line, const ProgramInputs& inputs) {
  const test::TempFolder folder;
  const test::CommandResult result = test::run(line.words(inputs.at(), folder.path().string() + "/"));
  INFO(result.err);
  REQUIRE(result.status == 0);
  REQUIRE(folder.names() == line.outputs);
  return contents_of(folder);
}

}  // namespace hiprt::checks
