#pragma once
/// The tools under test, from the build folder, small inputs for them, and checks of successful runs.

#include "run_command.h"
#include "temp_folder.h"

#include <tests/catch.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace hiprt::test {

/// Set by CMake.
inline const std::string kBvhBuild = HIPRT_BVHBUILD;
inline const std::string kBvhInfo = HIPRT_BVHINFO;
inline const std::string kBvhTrace = HIPRT_BVHTRACE;

/// It ended well and had nothing to complain of.
inline void check_good(const CommandResult& result) {
  INFO(result.out << result.err);
  CHECK(result.status == 0);
  CHECK(result.err.empty());
}

/// It ended well and without a word.
inline void check_quiet(const CommandResult& result) {
  check_good(result);
  CHECK(result.out.empty());
}

/// A failure prints one line that names the fault, and leaves only @p names in the folder.
inline void check_failure(const TempFolder& folder, const std::vector<std::string>& arguments, const std::string& word,
                          const std::vector<std::string>& names) {
  const CommandResult result = run(arguments);
  INFO(result.err);
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains(word));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
  CHECK(folder.names() == names);
}

/// An n x n grid of quads in the plane z = @p z, each of two triangles, over [0, n] x [0, n], as OBJ.
inline std::string grid_obj(unsigned n, float z = 0) {
  std::string text;
  for (unsigned y = 0; y <= n; ++y)
    for (unsigned x = 0; x <= n; ++x)
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  for (unsigned y = 0; y < n; ++y)
    for (unsigned x = 0; x < n; ++x) {
      const unsigned a = y * (n + 1) + x + 1, b = a + 1, c = a + n + 1, d = c + 1;
      for (const auto& [p, q, r] : {std::array{a, b, d}, std::array{a, d, c}})
        text += "f " + std::to_string(p) + " " + std::to_string(q) + " " + std::to_string(r) + "\n";
    }
  return text;
}

}  // namespace hiprt::test
