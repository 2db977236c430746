/// Wavefront OBJ: positions and faces. Shapes that make no triangles are counted. Written here because tinyobjloader
/// reads "nan" and unreadable numbers as 0 and wraps indices modulo 2^32, both without an error.

#include <tools/base/interrupt.h>
#include <tools/base/text.h>
#include <tools/scene_io/ignored.h>
#include <tools/scene_io/mesh/mesh_formats.h>
#include <tools/scene_io/mesh/polygons.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace hiprt::tools {
namespace {

/// Statements that a shape without triangles may have, and what they are.
constexpr std::array<std::pair<std::string_view, const char*>, 7> kIgnoredShapes{{{"l", "lines"},
                                                                                  {"p", "points"},
                                                                                  {"curv", "free-form curves"},
                                                                                  {"curv2", "free-form curves"},
                                                                                  {"surf", "free-form surfaces"},
                                                                                  {"call", "included files"},
                                                                                  {"csh", "commands"}}};
/// Attributes, groups and the parts of free-form shapes.
constexpr std::array<std::string_view, 31> kSilent{
    "vt",    "vn",  "vp",     "g",        "o",        "s",          "mg",        "usemtl", "mtllib", "usemap", "maplib",
    "bevel", "lod", "cstype", "deg",      "bmat",     "step",       "parm",      "trim",   "hole",   "scrv",   "sp",
    "end",   "con", "bsp",    "c_interp", "d_interp", "shadow_obj", "trace_obj", "ctech",  "stech"};

class ObjReader {
 public:
  explicit ObjReader(bool surfaces) : surfaces_(surfaces) {}

  build::Result<Mesh> read(std::string_view text) {
    skip_byte_order_mark(text);
    while (!text.empty()) {
      if (interrupted_at(line_)) return cancelled();
      std::string_view line = logical_line(text);
      const std::string_view keyword = next_word(line);
      build::Result<void> done;
      if (keyword == "v")
        done = read_vertex(without_comment(line));
      else if (keyword == "f" || keyword == "fo")
        done = read_face(without_comment(line));
      else if (!keyword.empty() && !keyword.starts_with('#'))
        ignore(keyword);
      if (!done) return tl::unexpected(done.error());
    }
    if (greatest_ >= static_cast<std::int64_t>(mesh_.positions.size()))
      return invalid_input("line " + std::to_string(greatest_line_) + ": face uses vertex " +
                           std::to_string(greatest_ + 1) + ", but the file has " +
                           std::to_string(mesh_.positions.size()));
    auto triangles = triangulate(mesh_.positions, faces_, mesh_.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_.triangles = std::move(*triangles);
    ignored_.warn(mesh_.warnings);
    return std::move(mesh_);
  }

 private:
  /// The next line. Lines that end with a backslash are joined with the following one; in a comment it is a path's.
  std::string_view logical_line(std::string_view& text) {
    std::string_view line = trimmed_line(text);
    if (!line.ends_with('\\') || without_comment(line).size() != line.size()) return line;
    joined_.clear();
    while (line.ends_with('\\')) {
      joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
      if (text.empty()) return joined_;
      line = trimmed_line(text);
    }
    joined_.append(line);
    return joined_;
  }

  std::string_view trimmed_line(std::string_view& text) {
    ++line_;
    std::string_view line = next_line(text);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
  }

  tl::unexpected<build::Error> fail(const std::string& what) const {
    return invalid_input("line " + std::to_string(line_) + ": " + what);
  }

  void ignore(std::string_view keyword) {
    const auto shape = std::find_if(kIgnoredShapes.begin(), kIgnoredShapes.end(),
                                    [&](const auto& known) { return known.first == keyword; });
    if (shape != kIgnoredShapes.end())
      ignored_.add(shape->second);
    else if (surfaces_ && keyword == "usemtl")
      ignored_.add("uses of materials");
    else if (surfaces_ && keyword == "vn")
      ignored_.add("normals");
    else if (std::find(kSilent.begin(), kSilent.end(), keyword) == kSilent.end())
      ignored_.add("lines with unknown keywords");
  }

  build::Result<void> read_vertex(std::string_view line) {
    build::Position position;
    for (float& coordinate : position) {
      const std::string_view word = next_word(line);
      if (word.empty()) return fail("vertex with fewer than three coordinates");
      const auto value = parse_real<float>(word);
      if (!value) return fail(in_quotes(word) + " is not a number");
      coordinate = *value;
    }
    // A fourth number alone is the weight of rational curves. More numbers are a colour.
    const std::string_view weight = next_word(line);
    const bool has_color = !weight.empty() && !next_word(line).empty();
    if (!weight.empty() && !has_color && parse_real<float>(weight) != 1.0f) ignored_.add("weights (w) of vertices");
    if (has_color && surfaces_) ignored_.add("colours of vertices");
    if (mesh_.positions.size() == std::numeric_limits<std::uint32_t>::max())
      return fail("more than " + std::to_string(mesh_.positions.size()) + " vertices");
    mesh_.positions.push_back(position);
    return {};
  }

  build::Result<void> read_face(std::string_view line) {
    std::uint32_t size = 0;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      auto corner = parse_corner(word);
      if (!corner) return tl::unexpected(corner.error());
      faces_.corners.push_back(*corner);
      ++size;
    }
    faces_.sizes.push_back(size);
    return {};
  }

  /// "7", "7/1", "7//3", "7/1/3": the vertex number is what counts; from 1, or from the end when negative.
  build::Result<std::uint32_t> parse_corner(std::string_view word) {
    const auto number = parse_integer(word.substr(0, word.find('/')));
    if (!number) return fail(in_quotes(word) + " is not a vertex number");
    const auto known = static_cast<std::int64_t>(mesh_.positions.size());
    if (*number == 0) return fail("vertex number 0: they start at 1");
    if (*number < -known)
      return fail("vertex " + std::to_string(*number) + ", but only " + std::to_string(known) + " are known");
    const std::int64_t index = *number > 0 ? *number - 1 : known + *number;
    if (index > greatest_) {
      greatest_ = index;
      greatest_line_ = line_;
    }
    // A number past 32 bits is past the vertices too, and refused at the end of the file.
    return static_cast<std::uint32_t>(index);
  }

  Mesh mesh_;
  Polygons faces_;
  Ignored ignored_;
  bool surfaces_;
  std::string joined_;
  std::uint64_t line_ = 0, greatest_line_ = 0;
  std::int64_t greatest_ = -1;  ///< Vertices may follow the faces that use them, so this is checked last.
};

}  // namespace

build::Result<Mesh> read_obj(std::span<const std::byte> bytes, bool surfaces) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (is_utf16(text)) return invalid_input(kUtf16Fault);
  auto mesh = ObjReader(surfaces).read(text);
  if (mesh && mesh->positions.empty()) return invalid_input("no 'v' line: not an OBJ file, or an empty one");
  return mesh;
}

}  // namespace hiprt::tools
