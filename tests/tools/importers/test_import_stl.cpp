#include <tests/tools/load.h>

#include <array>
#include <cctype>
#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

using Facet = std::array<build::Position, 3>;

const float kNan = std::numeric_limits<float>::quiet_NaN();
const std::vector<Facet> kFacets{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
                                 {{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}}},
                                 {{{kNan, 0, 0}, {1, 0, 0}, {0, 1, 2}}},
                                 {{{0, 0, 1}, {1.5f, 0, 1}, {0, 1e10f, 1}}}};

std::string binary(const std::string& title = "made by a test") {
  std::string bytes = title;
  bytes.resize(80);
  append(bytes, static_cast<std::uint32_t>(kFacets.size()));
  for (const Facet& facet : kFacets) {
    append(bytes, 0.0f, 0.0f, 1.0f);
    for (const auto& corner : facet) append(bytes, corner[0], corner[1], corner[2]);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string ascii(const std::string& name, std::size_t first, std::size_t last) {
  std::string text = "solid " + name + "\n";
  for (std::size_t i = first; i < last; ++i) {
    text += "  facet normal 0 0 1\n    outer loop\n";
    for (const auto& c : kFacets[i])
      text += "      vertex " + std::to_string(c[0]) + " " + std::to_string(c[1]) + " " + std::to_string(c[2]) + "\n";
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid " + name + "\n";
}

void check_facets(const tools::Mesh& mesh) {
  REQUIRE(mesh.triangles.size() == kFacets.size());
  for (std::size_t i = 0; i < kFacets.size(); ++i)
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float expected = kFacets[i][corner][axis], got = mesh.positions[mesh.triangles[i][corner]][axis];
        INFO("facet " << i << " corner " << corner << " axis " << axis);
        CHECK((got == expected || (std::isnan(got) && std::isnan(expected))));
      }
}

}  // namespace

TEST_CASE("STL: binary, ASCII and several solids give every facet in order, degenerate and NaN ones too") {
  const TempFolder folder;
  check_facets(load(folder.write("b.stl", binary())));
  check_facets(load(folder.write("misleading.stl", binary("solid but binary"))));
  check_facets(load(folder.write("a.STL", ascii("one", 0, 4))));
  check_facets(load(folder.write("two.stl", ascii("one", 0, 1) + ascii("two", 1, 4))));
}

TEST_CASE("STL: ASCII files are recognised in any case, behind blanks and a byte order mark") {
  const TempFolder folder;
  const std::string text = ascii("one", 0, 4);
  std::string upper = text;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (const std::string mark : {"", "\xef\xbb\xbf"})
    for (const std::string before : {"", "\n", "\r\n \t\n", "   "})
      for (const std::string& content : {text, upper}) {
        INFO(mark << before << content.substr(0, 20));
        check_facets(load(folder.write("a.stl", mark + before + content)));
        check_facets(load(folder.write("unknown", mark + before + content)));
      }
  check_facets(load(folder.write("b.stl", binary("SOLID but binary"))));
  check_facets(load(folder.write("c.stl", binary("\n solid but binary"))));
}

TEST_CASE("STL: ASCII files may be one line, or have lines that end with CR") {
  const TempFolder folder;
  for (const std::string names : {"|", "one|two", "my solid thing|another solid", "facet holder|outer loop"}) {
    const std::size_t bar = names.find('|');
    const std::string text = ascii(names.substr(0, bar), 0, 1) + ascii(names.substr(bar + 1), 1, 4);
    for (const std::string end : {" ", "\r", "\r\n", "\n\n"}) {
      std::string changed;
      for (const char c : text) changed += c == '\n' ? end : std::string(1, c);
      INFO(changed);
      check_facets(load(folder.write("a.stl", changed)));
      changed.replace(changed.rfind("endloop"), 7, "endlop!");
      // 7 lines per facet, 2 more per solid; the last endloop is the third line from the end.
      const std::string line = end == " " ? "line 1:" : end == "\n\n" ? "line 59:" : "line 30:";
      CHECK_THAT(refusal(folder.write("bad.stl", changed)), Contains(line) && Contains("'endlop!'"));
    }
  }
  CHECK(load(folder.write("none.stl", "solid a endsolid a solid b endsolid b")).triangles.empty());
  CHECK_THAT(refusal(folder.write("cut.stl", "solid a facet normal 0 0 1 outer loop vertex 1 2")),
             Contains("three coordinates"));
}

TEST_CASE("STL: a file without facets is an empty mesh") {
  const TempFolder folder;
  std::string bytes(80, 'x');
  append(bytes, 0u);
  CHECK(load(folder.write("none.stl", bytes)).triangles.empty());
  CHECK(load(folder.write("none.stl", "solid none\nendsolid none\n")).triangles.empty());
}

TEST_CASE("STL: truncated and wrong files are refused") {
  const TempFolder folder;
  const auto message = [&](const std::string& text) { return refusal(folder.write("bad.stl", text)); };
  const std::string whole = binary();
  for (std::size_t size = 1; size < whole.size(); size += 3) message(whole.substr(0, size));
  CHECK_THAT(message(whole.substr(0, whole.size() - 30)), Contains("4 facets") && Contains("284 bytes"));
  std::string huge = whole;
  huge.replace(80, 4, "\xff\xff\xff\xff");
  CHECK_THAT(message(huge), Contains("4294967295 facets"));
  CHECK_THAT(message(std::string(20, 'x')), Contains("too few"));
  const std::string text = ascii("one", 0, 4);
  // Between facets a cut file cannot be told from one without 'endsolid': there is a warning.
  for (std::size_t size = 1; size < text.rfind("endsolid"); size += 5) {
    const auto path = folder.write("bad.stl", text.substr(0, size));
    if (const auto mesh = tools::load_mesh(path))
      CHECK_THAT(mesh->warnings.back(), Contains("no 'endsolid'"));
    else
      refusal(path);
  }
  CHECK_THAT(message(text.substr(0, 200)), Contains("endsolid"));
  std::string word = text;
  CHECK_THAT(message(word.replace(word.find("1.000000"), 8, "onehalf!")), Contains("line 5") && Contains("'onehalf!'"));
  word = text;
  CHECK_THAT(message(word.replace(word.find("endfacet"), 8, "endfact?")), Contains("'endfact?'"));
  word = text;
  CHECK_THAT(message(word.replace(word.find("1.000000 0.000000 0.000000"), 26, "1 0")), Contains("three coordinates"));
  CHECK_THAT(message("solid a\nfacet normal 0 0 1\nvertex 0 0 0\nendfacet\nendsolid\n"), Contains("1 corners"));
  CHECK_THAT(message("solid a\nvertex 0 0 0\nendsolid\n"), Contains("outside of a facet"));
  CHECK_THAT(message("solid a\nendsolid a\ngarbage\n"), Contains("line 3") && Contains("'garbage'"));
}
