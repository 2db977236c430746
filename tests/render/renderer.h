#pragma once
/// bvhrender from the build folder, and scenes for its tests.

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <tests/tools/run_command.h>
#include <tests/tools/temp_folder.h>

#include <tests/catch.h>

#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

/// Set by CMake.
inline const std::string kBvhRender = HIPRT_BVHRENDER;

/// Straight at the scene below; the rays through the middle pixel of an odd number of pixels are exactly -z.
inline const std::string kFront = "0,0,4/0,0,0/0,1,0/40";

/// @return the path of a BVH file with two squares of two triangles each, in planes of constant z, y up:
/// geometry 0 is [-1, 1]^2 at z = 0, geometry 1 is [0.5, 1]^2 at z = 1.
inline std::string write_squares(const TempFolder& folder, const std::string& name = "s.bvh") {
  const auto square = [](float low, float z) {
    return std::vector<build::Position>{{low, low, z}, {1, low, z}, {1, 1, z}, {low, 1, z}};
  };
  const std::vector<build::Position> back = square(-1, 0), front = square(0.5f, 1);
  const std::vector<build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  const std::vector<build::TriangleMesh> meshes{{back, triangles}, {front, triangles}};
  const auto bvh = build::build(meshes);
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / name, bvh->buffer.bytes()).has_value());
  return folder / name;
}

/// @return the path of a valid BVH file without triangles.
inline std::string write_nothing(const TempFolder& folder, const std::string& name = "empty.bvh") {
  const auto bvh = build::build(build::SceneInput{});
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / name, bvh->buffer.bytes()).has_value());
  return folder / name;
}

/// Runs bvhrender with more arguments.
inline CommandResult render(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), kBvhRender);
  return run(std::move(arguments));
}

/// Runs it where it must succeed; in a pipe it prints a summary, no progress and no warning.
inline std::string render_well(std::vector<std::string> arguments) {
  const CommandResult result = render(std::move(arguments));
  INFO(result.err);
  REQUIRE(result.status == 0);
  REQUIRE(result.err.empty());
  REQUIRE(result.out.find_first_of("\r\033") == std::string::npos);
  return result.out;
}

}  // namespace hiprt::test
