#pragma once
/// Helpers of the importer tests.

#include "temp_folder.h"

#include <tools/scene_io/mesh/mesh_import.h>

#include <tests/catch.h>

#include <cmath>
#include <string>
#include <vector>

namespace hiprt::test {

using Positions = std::vector<build::Position>;
using Triangles = std::vector<build::Triangle>;

inline tools::Mesh load(const std::filesystem::path& path) {
  auto mesh = tools::load_mesh(path);
  if (!mesh) FAIL(mesh.error().message);
  return std::move(*mesh);
}

/// The one-line message of a refused file; it names the path first.
inline std::string refusal(const std::filesystem::path& path) {
  const auto mesh = tools::load_mesh(path);
  if (mesh) FAIL(path.string() + " was accepted");
  std::string message = mesh.error().message;
  INFO(message);
  CHECK(message.find('\n') == std::string::npos);
  CHECK(message.find(path.filename().string()) != std::string::npos);
  return message;
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace hiprt::test
