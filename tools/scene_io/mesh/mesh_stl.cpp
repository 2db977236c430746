/// Reads STL, ASCII and binary (3D Systems, 1988). assimp is not used: it accepts ASCII files that are truncated
/// between two facets. It also leaks memory when it rejects a file, and does not always round numbers correctly.

#include <tools/base/interrupt.h>
#include <tools/base/text.h>
#include <tools/scene_io/ignored.h>
#include <tools/scene_io/mesh/mesh_formats.h>
#include <tools/scene_io/mesh/polygons.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <limits>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are little-endian and copied as they are");

constexpr std::uint64_t kBinaryHeaderBytes = 84, kFacetBytes = 50, kNormalBytes = 12;

/// Facet count of a binary file's header; 0 without header.
std::uint32_t facet_count(std::span<const std::byte> bytes) {
  std::uint32_t facets = 0;
  if (bytes.size() >= kBinaryHeaderBytes) std::memcpy(&facets, bytes.data() + 80, sizeof(facets));
  return facets;
}

void warn_rest(Mesh& mesh, std::uint64_t bytes) {
  Ignored ignored;
  ignored.add("bytes behind the last facet", bytes);
  ignored.warn(mesh.warnings);
}

build::Result<Mesh> read_binary(std::span<const std::byte> bytes) {
  if (bytes.size() < kBinaryHeaderBytes)
    return invalid_input(std::to_string(bytes.size()) + " bytes are too few for the header of a binary STL file, 84");
  const std::uint32_t facets = facet_count(bytes);
  const std::uint64_t expected = kBinaryHeaderBytes + kFacetBytes * facets;
  if (bytes.size() < expected)
    return invalid_input("truncated: the header says " + std::to_string(facets) + " facets, which takes " +
                         std::to_string(expected) + " bytes, but the file has " + std::to_string(bytes.size()));
  if (facets > std::numeric_limits<std::uint32_t>::max() / 3)
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 corners"});
  Mesh mesh;
  if (bytes.size() > expected) warn_rest(mesh, bytes.size() - expected);
  mesh.positions.resize(3 * std::size_t{facets});
  mesh.triangles.resize(facets);
  for (std::uint32_t i = 0; i < facets; ++i) {
    if (interrupted_at(i)) return cancelled();
    const std::byte* corners = bytes.data() + kBinaryHeaderBytes + kFacetBytes * i + kNormalBytes;
    std::memcpy(&mesh.positions[3 * std::size_t{i}], corners, 3 * sizeof(build::Position));
    mesh.triangles[i] = {3 * i, 3 * i + 1, 3 * i + 2};
  }
  return mesh;
}

std::string lower(std::string_view word) {
  std::string text(word);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_keyword(std::string_view word) {
  constexpr std::array<std::string_view, 8> kKeywords{"solid",  "facet",   "outer",    "loop",
                                                      "vertex", "endloop", "endfacet", "endsolid"};
  return std::find(kKeywords.begin(), kKeywords.end(), lower(word)) != kKeywords.end();
}

/// The words of a text, regardless of line ends. A copy marks a position to return to.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  /// Removes and returns the next word; empty at the end.
  std::string_view next() { return next_word_of_lines(text_, line_); }

  /// @return whether @p word is next, in upper or lower case.
  bool next_is(std::string_view word) const { return lower(Words(*this).next()) == word; }

  /// The line of the last word.
  std::uint64_t line() const { return line_; }
  std::string_view rest() const { return text_; }

 private:
  std::string_view text_;
  std::uint64_t line_ = 1;
};

/// Reads ASCII files. Line ends matter only for the name of a solid: it ends with the line, or before words that can
/// only begin a facet. The last solid may lack its end, and other bytes may follow the last facet: then there is a
/// warning.
class AsciiReader {
 public:
  explicit AsciiReader(std::string_view text) : words_(text) {}

  build::Result<Mesh> read() {
    std::uint64_t count = 0;
    for (std::string_view word = words_.next(); !word.empty(); word = words_.next()) {
      if (interrupted_at(++count)) return cancelled();
      if (is_rest(word)) {
        warn_rest(mesh_, word.size() + words_.rest().size());
        break;
      }
      if (auto done = read_word(word); !done) return tl::unexpected(done.error());
    }
    if (in_facet_ || (in_solid_ && facets_.sizes.empty())) return truncated();
    if (in_solid_) mesh_.warnings.emplace_back("the last solid has no 'endsolid': is the file whole?");
    auto triangles = triangulate(mesh_.positions, facets_, mesh_.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_.triangles = std::move(*triangles);
    return std::move(mesh_);
  }

 private:
  tl::unexpected<build::Error> fail(const std::string& what) const {
    return invalid_input("line " + std::to_string(words_.line()) + ": " + what);
  }

  tl::unexpected<build::Error> truncated() const { return fail("truncated: the solid has no 'endsolid'"); }

  /// Is a word no keyword, behind a facet, and was that facet the last?
  bool is_rest(std::string_view word) const {
    if (in_facet_ || facets_.sizes.empty() || is_keyword(word)) return false;
    const std::string_view rest = words_.rest();
    return rest.find("vertex") == std::string_view::npos && rest.find("VERTEX") == std::string_view::npos;
  }

  build::Result<void> read_word(std::string_view word) {
    const std::string keyword = lower(word);
    if (!in_solid_) {
      if (keyword != "solid") return fail("'solid' was expected, not " + in_quotes(keyword));
      in_solid_ = true;
      skip_name();
      return {};
    }
    if (keyword == "vertex") return read_vertex();
    if (keyword == "facet") return open_facet();
    if (keyword == "endfacet") return close_facet();
    if (keyword == "endsolid") {
      if (in_facet_) return fail("'endsolid' inside a facet");
      in_solid_ = false;
      skip_name_behind_end();
      return {};
    }
    if (keyword == "outer" && words_.next_is("loop")) words_.next();
    if (keyword == "outer" || keyword == "endloop") return {};
    return words_.next_is("") ? truncated() : fail("unknown keyword " + in_quotes(keyword));
  }

  void skip_name() {
    for (Words ahead = words_;; words_ = ahead) {
      const std::string word = lower(ahead.next());
      if (word.empty() || ahead.line() != words_.line() || word == "endsolid") return;
      if (word == "facet" && ahead.next_is("normal")) return;
    }
  }

  /// The name may hold the word "solid"; the last one before a facet of the same line starts the next solid.
  void skip_name_behind_end() {
    Words next_solid = words_;
    for (Words ahead = words_;;) {
      const Words before = ahead;
      const std::string word = lower(ahead.next());
      const bool line_ends = word.empty() || ahead.line() != words_.line();
      const bool facet = word == "facet" && ahead.next_is("normal");
      if (line_ends || facet) {
        words_ = line_ends ? before : next_solid;
        return;
      }
      if (word == "solid") next_solid = before;
    }
  }

  build::Result<void> open_facet() {
    if (in_facet_) return fail("'facet' inside a facet");
    in_facet_ = true;
    facets_.sizes.push_back(0);
    if (!words_.next_is("normal")) return {};
    words_.next();
    for (int axis = 0; axis < 3; ++axis)
      if (!is_keyword(Words(words_).next())) words_.next();
    return {};
  }

  build::Result<void> close_facet() {
    if (!in_facet_) return fail("'endfacet' without 'facet'");
    if (facets_.sizes.back() < 3) return fail("a facet with " + std::to_string(facets_.sizes.back()) + " corners");
    in_facet_ = false;
    return {};
  }

  build::Result<void> read_vertex() {
    if (!in_facet_) return fail("'vertex' outside of a facet");
    build::Position position;
    for (float& coordinate : position) {
      Words ahead = words_;
      const std::string_view word = ahead.next();
      const auto value = parse_real<float>(word);
      if (!value && (word.empty() || is_keyword(word))) return fail("a vertex has three coordinates");
      words_ = ahead;
      if (!value) return fail(in_quotes(word) + " is not a number");
      coordinate = *value;
    }
    if (mesh_.positions.size() == std::numeric_limits<std::uint32_t>::max())
      return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 corners"});
    facets_.corners.push_back(static_cast<std::uint32_t>(mesh_.positions.size()));
    ++facets_.sizes.back();
    mesh_.positions.push_back(position);
    return {};
  }

  Words words_;
  Mesh mesh_;
  Polygons facets_;
  bool in_solid_ = false, in_facet_ = false;
};

}  // namespace

bool starts_with_solid(std::span<const std::byte> bytes) {
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  skip_byte_order_mark(text);
  return Words(text).next_is("solid");
}

build::Result<Mesh> read_stl(std::span<const std::byte> bytes) {
  // Many binary files begin with "solid", too. Their size identifies them.
  const bool has_binary_size = bytes.size() == kBinaryHeaderBytes + kFacetBytes * facet_count(bytes);
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (!has_binary_size && is_utf16(text)) return invalid_input(kUtf16Fault);
  if (has_binary_size || !starts_with_solid(bytes)) return read_binary(bytes);
  skip_byte_order_mark(text);
  return AsciiReader(text).read();
}

}  // namespace hiprt::tools
