#pragma once
/// What the golden files of every version hold. Compiles with the library of each version: write_files.cpp makes the
/// files from it, test_versions.cpp aims rays at it.

#include <hiprt_build/build.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace hiprt::golden {

/// An indexed triangle mesh.
struct Mesh {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
};

inline constexpr unsigned kTiles = 6;

/// The corner of tile @p i with the least coordinates. A tile is a unit square, parallel to the plane z = 0.
inline build::Position tile(unsigned i) {
  const unsigned column = i % 3, row = i / 3;
  return {2 * static_cast<float>(column), 2 * static_cast<float>(row), 0.25f * static_cast<float>(i)};
}

/// Geometry 0 of most files. Tile i is triangles 2i and 2i + 1. The last triangle has two equal corners and is dropped.
inline Mesh tiles() {
  Mesh mesh;
  for (unsigned i = 0; i < kTiles; ++i) {
    const auto [x, y, z] = tile(i);
    mesh.positions.insert(mesh.positions.end(), {{x, y, z}, {x + 1, y, z}, {x, y + 1, z}, {x + 1, y + 1, z}});
    mesh.triangles.insert(mesh.triangles.end(), {{4 * i, 4 * i + 1, 4 * i + 2}, {4 * i + 1, 4 * i + 3, 4 * i + 2}});
  }
  mesh.triangles.push_back({0, 0, 1});
  return mesh;
}

/// Geometry 1, with mask 2: one triangle beside the tiles.
inline Mesh flag() { return {{{6, 0, 0}, {7, 0, 0}, {6, 1, 0}}, {{0, 1, 2}}}; }

inline constexpr unsigned kField = 200;

/// Squares in a row: more than 64 nodes. Square i is triangles 2i and 2i + 1.
inline Mesh field() {
  Mesh mesh;
  for (unsigned i = 0; i < kField; ++i) {
    const float x = 2 * static_cast<float>(i), z = 0.25f * static_cast<float>(i % 5);
    mesh.positions.insert(mesh.positions.end(), {{x, 0, z}, {x + 1, 0, z}, {x, 1, z}, {x + 1, 1, z}});
    mesh.triangles.insert(mesh.triangles.end(), {{4 * i, 4 * i + 1, 4 * i + 2}, {4 * i + 1, 4 * i + 3, 4 * i + 2}});
  }
  return mesh;
}

inline constexpr unsigned kSlivers = 12;

/// Long diagonal triangles, triangle i at z = i / 4: builders with spatial splits put them into several leaves.
inline Mesh slivers() {
  Mesh mesh;
  for (unsigned i = 0; i < kSlivers; ++i) {
    const float y = static_cast<float>(i), z = 0.25f * y;
    mesh.positions.insert(mesh.positions.end(), {{0, y, z}, {1, y, z}, {32, y + 32, z}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

inline constexpr unsigned kBoxes = 5, kInvertedBox = 2;

/// Boxes of custom primitives: unit cubes in a row at y = 20. Box 2 is inverted, so its primitive is dropped.
inline std::vector<Box> boxes() {
  std::vector<Box> boxes;
  for (unsigned i = 0; i < kBoxes; ++i) {
    const float x = 3 * static_cast<float>(i);
    boxes.push_back({{x, 20, 0}, {i == kInvertedBox ? x - 1 : x + 1, 21, 1}});
  }
  return boxes;
}
inline constexpr std::uint32_t kBoxType = 7, kLargeType = 70000;

/// Translation of moving instances along x between times 0 and 1, and sine of half their turn about z.
inline constexpr float kMove = 16, kSine45 = 0.70710678f;
/// Instances stand this far apart along y.
inline constexpr float kRow = 40;
/// The number InstanceRecord::id of instance 0; the others follow.
inline constexpr std::uint32_t kFirstId = 100;

}  // namespace hiprt::golden
