/// STL, ASCII and binary (3D Systems, 1988). Written here because assimp takes an ASCII file that ends between two
/// facets for a whole one, leaks memory when it refuses one, and rounds numbers only nearly right.

#include "mesh_formats.h"
#include "polygons.h"
#include "text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <limits>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are little-endian and copied as they are");

constexpr std::uint64_t kHeaderBytes = 84, kFacetBytes = 50, kNormalBytes = 12;

/// Facet count of a binary file's header; 0 if there is none.
std::uint32_t facet_count(std::span<const std::byte> bytes) {
  std::uint32_t facets = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&facets, bytes.data() + 80, sizeof(facets));
  return facets;
}

build::Result<Mesh> read_binary(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes)
    return invalid_input(std::to_string(bytes.size()) + " bytes are too few for the header of a binary STL file, 84");
  const std::uint32_t facets = facet_count(bytes);
  const std::uint64_t expected = kHeaderBytes + kFacetBytes * facets;
  if (bytes.size() != expected)
    return invalid_input("the header says " + std::to_string(facets) + " facets, which takes " +
                         std::to_string(expected) + " bytes, but the file has " + std::to_string(bytes.size()));
  if (facets > std::numeric_limits<std::uint32_t>::max() / 3)
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 corners"});
  Mesh mesh;
  mesh.positions.resize(3 * std::size_t{facets});
  mesh.triangles.resize(facets);
  for (std::uint32_t i = 0; i < facets; ++i) {
    const std::byte* corners = bytes.data() + kHeaderBytes + kFacetBytes * i + kNormalBytes;
    std::memcpy(&mesh.positions[3 * std::size_t{i}], corners, 3 * sizeof(build::Position));
    mesh.triangles[i] = {3 * i, 3 * i + 1, 3 * i + 2};
  }
  return mesh;
}

class AsciiReader {
 public:
  build::Result<Mesh> read(std::string_view text) {
    while (!text.empty()) {
      ++line_;
      std::string_view line = next_line(text);
      if (auto done = read_line(line); !done) return tl::unexpected(done.error());
    }
    if (in_solid_) return fail("truncated: the solid has no 'endsolid'");
    auto triangles = triangulate(mesh_.positions, facets_, mesh_.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_.triangles = std::move(*triangles);
    return std::move(mesh_);
  }

 private:
  tl::unexpected<build::Error> fail(const std::string& what) const {
    return invalid_input("line " + std::to_string(line_) + ": " + what);
  }

  build::Result<void> read_line(std::string_view line) {
    std::string keyword(next_word(line));
    std::transform(keyword.begin(), keyword.end(), keyword.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (keyword.empty()) return {};
    if (!in_solid_) {
      if (keyword != "solid") return fail("'solid' was expected, not " + in_quotes(keyword));
      in_solid_ = true;
      return {};
    }
    if (keyword == "vertex") return read_vertex(line);
    if (keyword == "facet") return open_facet();
    if (keyword == "endfacet") return close_facet();
    if (keyword == "endsolid") {
      if (in_facet_) return fail("'endsolid' inside a facet");
      in_solid_ = false;
      return {};
    }
    if (keyword == "outer" || keyword == "endloop") return {};
    return fail("unknown keyword " + in_quotes(keyword));
  }

  build::Result<void> open_facet() {
    if (in_facet_) return fail("'facet' inside a facet");
    in_facet_ = true;
    facets_.sizes.push_back(0);
    return {};
  }

  build::Result<void> close_facet() {
    if (!in_facet_) return fail("'endfacet' without 'facet'");
    if (facets_.sizes.back() < 3) return fail("a facet with " + std::to_string(facets_.sizes.back()) + " corners");
    in_facet_ = false;
    return {};
  }

  build::Result<void> read_vertex(std::string_view line) {
    if (!in_facet_) return fail("'vertex' outside of a facet");
    build::Position position;
    for (float& coordinate : position) {
      const std::string_view word = next_word(line);
      const auto value = parse_real<float>(word);
      if (!value) return fail(word.empty() ? "a vertex has three coordinates" : in_quotes(word) + " is not a number");
      coordinate = *value;
    }
    if (mesh_.positions.size() == std::numeric_limits<std::uint32_t>::max())
      return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 corners"});
    facets_.corners.push_back(static_cast<std::uint32_t>(mesh_.positions.size()));
    ++facets_.sizes.back();
    mesh_.positions.push_back(position);
    return {};
  }

  Mesh mesh_;
  Polygons facets_;
  std::uint64_t line_ = 0;
  bool in_solid_ = false, in_facet_ = false;
};

}  // namespace

build::Result<Mesh> read_stl(std::span<const std::byte> bytes) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  // Many binary files begin with "solid" too; their size gives them away.
  const bool has_binary_size = bytes.size() == kHeaderBytes + kFacetBytes * facet_count(bytes);
  return text.starts_with("solid") && !has_binary_size ? AsciiReader{}.read(text) : read_binary(bytes);
}

}  // namespace hiprt::tools
