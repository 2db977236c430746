/// make_scene NAME DIR [--strands N | --motion N]: generates large scenes for bvhbuild and the other tools.
///     hair     hair.hair, head.mesh, hair.cam: a head of 100,000 strands, or N
///     island   island.scene, island.cam: three levels of instances, more than 30 thousand million triangles
///     stadium  stadium.mesh, stadium.cam: a teapot in a stadium, 2 million triangles
///     swarm    swarm.json, swarm.mesh, swarm.cam: 10,000 instances that move and rotate between the times 0 and 1
///              swarm_still.json: the same instances, static, at time 0.5
/// --motion sets the motion to N percent of the default.

#include "../common/hair.h"
#include "../common/island.h"
#include "../common/mesh_parts.h"
#include "../common/random.h"
#include "../common/stadium.h"

#include <hiprt_build/file.h>
#include <tools/base/text.h>
#include <tools/scene_io/scene/scene_binary.h>
#include <tools/scene_io/shapes/shape_import.h>

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hiprt::bench {
namespace {

build::Result<void> write_camera(const std::filesystem::path& path, const tools::Camera& camera) {
  const std::string text = tools::to_text(camera) + "\n";
  return build::write_file(path, std::as_bytes(std::span(text)));
}

build::Result<void> write_mesh(const std::filesystem::path& path, const tools::Mesh& mesh) {
  const std::uint32_t counts[2] = {static_cast<std::uint32_t>(mesh.positions.size()),
                                   static_cast<std::uint32_t>(mesh.triangles.size())};
  std::vector<std::byte> bytes;
  const auto put = [&](std::span<const std::byte> part) { bytes.insert(bytes.end(), part.begin(), part.end()); };
  put(std::as_bytes(std::span(counts)));
  put(std::as_bytes(std::span(mesh.positions)));
  put(std::as_bytes(std::span(mesh.triangles)));
  return build::write_file(path, bytes);
}

/// A torus around y.
tools::Mesh torus() {
  constexpr std::uint32_t kAround = 96, kAcross = 32;
  tools::Mesh mesh;
  for (std::uint32_t row = 0; row <= kAround; ++row)
    for (std::uint32_t column = 0; column <= kAcross; ++column) {
      const double a = kTurn * (row % kAround) / kAround, b = kTurn * (column % kAcross) / kAcross;
      const double r = 1.0 + 0.4 * std::cos(b);
      add_vertex(mesh, {r * std::cos(a), 0.4 * std::sin(b), r * std::sin(a)});
    }
  add_grid_triangles(mesh, 0, kAcross, kAround);
  return mesh;
}

nlohmann::json scene_json(nlohmann::json instances) {
  return {{"format", "hiprt scene"},
          {"version", 1},
          {"scene", "swarm"},
          {"objects", {{"torus", {"swarm.mesh"}}}},
          {"groups", {{"swarm", std::move(instances)}}}};
}

/// @param motion 1: instances move by up to 1.5 per axis (a torus is 2.8 wide) and rotate by up to 40 degrees.
build::Result<void> write_swarm(const std::filesystem::path& folder, double motion) {
  constexpr std::uint32_t kCount = 10'000;
  constexpr double kHalf = 45, kFlight = 1.5, kMostDegrees = 40;
  Random random(3);
  auto moving = nlohmann::json::array(), still = nlohmann::json::array();
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const auto point = [&](double half) {
      return std::array{random.between(-half, half), random.between(-half, half), random.between(-half, half)};
    };
    const auto at = point(kHalf), by = point(motion * kFlight), axis = point(1.0);
    const double first = random.between(0, 360), turn = motion * random.between(-kMostDegrees, kMostDegrees);
    const auto key = [&](double part) {
      return nlohmann::json{{"translate", {at[0] + part * by[0], at[1] + part * by[1], at[2] + part * by[2]}},
                            {"rotate", {{"axis", axis}, {"degrees", first + part * turn}}}};
    };
    nlohmann::json half = key(0.5), begin = key(0), end = key(1);
    begin["time"] = 0;
    end["time"] = 1;
    half["object"] = "torus";
    still.push_back(std::move(half));
    moving.push_back({{"object", "torus"}, {"motion", {{"keys", {std::move(begin), std::move(end)}}}}});
  }
  const auto write_json = [&](const char* name, nlohmann::json instances) {
    const std::string text = scene_json(std::move(instances)).dump();
    return build::write_file(folder / name, std::as_bytes(std::span(text)));
  };
  if (auto done = write_mesh(folder / "swarm.mesh", torus()); !done) return done;
  if (auto done = write_camera(folder / "swarm.cam", {.eye = {0, 20, 120}, .fov_degrees = 45}); !done) return done;
  if (auto done = write_json("swarm.json", std::move(moving)); !done) return done;
  return write_json("swarm_still.json", std::move(still));
}

build::Result<void> write_hair(const std::filesystem::path& folder, std::uint32_t strands) {
  const Hair head = hair(strands);
  if (auto done = write_camera(folder / "hair.cam", hair_camera()); !done) return done;
  if (auto done = write_mesh(folder / "head.mesh", hair_head()); !done) return done;
  return build::write_file(folder / "hair.hair",
                           tools::hair_file(head.strands, head.points, "make_scene hair, units: cm"));
}

/// @param amount strands of hair, or percent of the swarm's motion.
build::Result<void> write(std::string_view name, const std::filesystem::path& folder, std::int64_t amount) {
  if (name == "hair") return write_hair(folder, static_cast<std::uint32_t>(amount));
  if (name == "island") {
    if (auto done = write_camera(folder / "island.cam", island_camera()); !done) return done;
    return tools::write_scene_binary(folder / "island.scene", island());
  }
  if (name == "swarm") return write_swarm(folder, 0.01 * static_cast<double>(amount));
  if (auto done = write_camera(folder / "stadium.cam", stadium_camera()); !done) return done;
  return write_mesh(folder / "stadium.mesh", stadium());
}

/// A scene's option with its limits and default.
struct SceneOption {
  std::string_view scene, option;
  std::int64_t least, most, usual;
};
constexpr SceneOption kScenes[] = {{"hair", "--strands", 1, 500'000'000, 100'000},
                                   {"island", "", 0, 0, 0},
                                   {"stadium", "", 0, 0, 0},
                                   {"swarm", "--motion", 0, 1000, 100}};

/// The arguments of write(); nothing if the command line is invalid.
std::optional<std::int64_t> amount(std::span<char* const> arguments) {
  for (const SceneOption& scene : kScenes) {
    if (arguments.size() < 3 || scene.scene != arguments[1]) continue;
    if (arguments.size() == 3) return scene.usual;
    if (arguments.size() != 5 || scene.option.empty() || scene.option != arguments[3]) return std::nullopt;
    const auto given = tools::parse_integer(arguments[4]);
    return given && *given >= scene.least && *given <= scene.most ? given : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  const auto amount = hiprt::bench::amount({argv, static_cast<std::size_t>(argc)});
  if (!amount) {
    std::cerr << "usage: make_scene island|stadium DIR\n";
    for (const auto& [scene, option, least, most, usual] : hiprt::bench::kScenes)
      if (!option.empty())
        std::cerr << "       make_scene " << scene << " DIR [" << option << " N], " << least << " to " << most
                  << ", usually " << usual << "\n";
    return 2;
  }
  std::error_code ignored;
  std::filesystem::create_directories(argv[2], ignored);
  const auto written = hiprt::bench::write(argv[1], argv[2], *amount);
  if (!written) std::cerr << "make_scene: " << written.error().message << "\n";
  return written ? 0 : 1;
}
