#include <tests/tools/load.h>

#include <array>
#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

std::string header(const std::string& format, const std::string& faces = "element face 4",
                   const std::string& list = "property list uchar int vertex_indices") {
  return "ply\nformat " + format +
         " 1.0\ncomment made by a test\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\n" +
         faces + "\n" + list + "\nproperty float quality\nelement edge 1\nproperty int a\nend_header\n";
}

const std::string kAsciiBody =
    "0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0.1 255\nnan -inf 1e-40 0\n3 0 1 2 0.5\n4 0 1 2 3 0.5\n3 1 1 4 0.5\n"
    "2 0 1 0.5\n77\n";

const Triangles kExpected{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {1, 1, 4}};

void check_mesh(const tools::Mesh& mesh) {
  REQUIRE(mesh.positions.size() == 5);
  CHECK(mesh.positions[3] == build::Position{0, 1, 0.1f});
  CHECK(std::isnan(mesh.positions[4][0]));
  CHECK(mesh.positions[4][1] == -std::numeric_limits<float>::infinity());
  CHECK(mesh.positions[4][2] == 1e-40f);
  CHECK(mesh.triangles == kExpected);
  CHECK(mesh.skipped_faces == 1);
}

/// Appends a value in the byte order of the file.
template <class T> void put(std::string& bytes, T value, bool big) {
  std::string raw;
  append(raw, value);
  if (big) std::reverse(raw.begin(), raw.end());
  bytes += raw;
}

std::string binary_body(bool big) {
  std::string bytes;
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const float vertices[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1f}, {nan, -inf, 1e-40f}};
  for (const auto& v : vertices) {
    for (const float c : v) put(bytes, c, big);
    put(bytes, std::uint8_t{255}, big);
  }
  for (const auto& face : std::vector<std::vector<std::int32_t>>{{0, 1, 2}, {0, 1, 2, 3}, {1, 1, 4}, {0, 1}}) {
    put(bytes, static_cast<std::uint8_t>(face.size()), big);
    for (const std::int32_t corner : face) put(bytes, corner, big);
    put(bytes, 0.5f, big);
  }
  put(bytes, std::int32_t{77}, big);
  return bytes;
}

}  // namespace

TEST_CASE("PLY: ASCII and both binary orders give the same mesh; NaN and degenerate faces are kept in order") {
  const TempFolder folder;
  check_mesh(load(folder.write("a.ply", header("ascii") + kAsciiBody)));
  check_mesh(load(folder.write("l.ply", header("binary_little_endian") + binary_body(false))));
  check_mesh(load(folder.write("b.PLY", header("binary_big_endian") + binary_body(true))));
  check_mesh(load(folder.write("by-content.bin", header("binary_big_endian") + binary_body(true))));
}

TEST_CASE("PLY: lines end with LF, CRLF or CR; a byte order mark is skipped") {
  const TempFolder folder;
  const auto ended = [](const std::string& text, const std::string& end) {
    std::string result;
    for (const char c : text) result += c == '\n' ? end : std::string(1, c);
    return result;
  };
  for (const std::string end : {"\n", "\r\n", "\r"})
    for (const std::string mark : {"", "\xef\xbb\xbf"}) {
      const std::string ascii = ended(header("ascii"), end);
      check_mesh(load(folder.write("a.ply", mark + ascii + ended(kAsciiBody, end))));
      check_mesh(load(folder.write("unknown", mark + ascii + ended(kAsciiBody, end))));
      check_mesh(load(folder.write("b.ply", mark + ended(header("binary_big_endian"), end) + binary_body(true))));
      std::string body = kAsciiBody;
      body.replace(body.find("1 1 0 255"), 9, "1 x 0 255");
      CHECK_THAT(refusal(folder.write("bad.ply", ascii + ended(body, end))), Contains("line 17"));
    }
  // The first byte of the data looks like the second half of a line's end.
  std::string data =
      "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty float x\rproperty float y\r"
      "property float z\relement face 0\rproperty list uchar int vertex_index\rend_header\r";
  append(data, std::uint32_t{0x3f80000a}, 2.0f, 3.0f);
  CHECK(load(folder.write("c.ply", data)).positions[0][1] == 2.0f);
}

TEST_CASE("PLY: double coordinates and 32-bit unsigned indices") {
  const TempFolder folder;
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uint vertex_index\n"
      "element vertex 3\nproperty double z\nproperty double y\nproperty double x\nend_header\n";
  append(bytes, 3u, 0u, 2u, 1u, 0.0, 0.0, 0.1, 0.0, 1e300, 1.0, 5.0, 0.0, 0.0);
  const auto mesh = load(folder.write("d.ply", bytes));
  CHECK(mesh.positions == Positions{{0.1f, 0, 0}, {1, std::numeric_limits<float>::infinity(), 0}, {0, 0, 5}});
  CHECK(mesh.triangles == Triangles{{0, 2, 1}});
}

TEST_CASE("PLY: every truncation of every encoding is refused") {
  const TempFolder folder;
  for (const std::string& whole :
       {header("binary_little_endian") + binary_body(false), header("binary_big_endian") + binary_body(true)})
    for (std::size_t size = 1; size < whole.size(); ++size) refusal(folder.write("cut.ply", whole.substr(0, size)));
  const std::string ascii = header("ascii") + kAsciiBody;
  for (std::size_t size = 1; size + 3 < ascii.size(); ++size) refusal(folder.write("cut.ply", ascii.substr(0, size)));
}

TEST_CASE("PLY: wrong content is refused with the position") {
  const TempFolder folder;
  const auto message = [&](const std::string& text) { return refusal(folder.write("bad.ply", text)); };
  CHECK_THAT(message(header("ascii", "element face 4000000000") + kAsciiBody),
             Contains("4000000000 elements 'face'") && Contains("bytes are left"));
  CHECK_THAT(message(header("binary_little_endian", "element face 4000000000") + binary_body(false)),
             Contains("4000000000 elements 'face'"));
  CHECK_THAT(message(header("ascii", "element face 9223372036854775807") + kAsciiBody), Contains("bytes are left"));
  CHECK_THAT(message(header("ascii", "element face -1") + kAsciiBody), Contains("'-1'"));
  CHECK_THAT(message(header("ascii") + "0 0 0 255\n1 zero 0 255\n"), Contains("vertex 1 of 5") || Contains("bytes"));
  std::string body = kAsciiBody;
  CHECK_THAT(message(header("ascii") + body.replace(body.find("3 0 1 2"), 7, "3 0 1 9")),
             Contains("face 0") && Contains("vertex 9") && Contains("only 5"));
  body = kAsciiBody;
  CHECK_THAT(message(header("ascii") + body.replace(body.find("3 0 1 2"), 7, "3 0 1 4294967296")), Contains("face 0"));
  body = kAsciiBody;
  CHECK_THAT(message(header("ascii") + body.replace(body.find("3 0 1 2"), 7, "3 0 1 -1")), Contains("face 0"));
  body = kAsciiBody;
  CHECK_THAT(message(header("ascii") + body.replace(body.find("3 0 1 2"), 7, "-3 0 1 2")), Contains("list cannot"));
  CHECK_THAT(message(header("ascii", "", "property int dummy") + kAsciiBody), Contains("no element 'face'"));
  CHECK_THAT(message(header("ascii", "element face 4", "property int dummy") + kAsciiBody), Contains("vertex_indices"));
  CHECK_THAT(message("ply\nformat ascii 2.0\nend_header\n"), Contains("line 2") && Contains("2.0"));
  CHECK_THAT(message("ply\nformat utf8 1.0\nend_header\n"), Contains("line 2") && Contains("utf8"));
  CHECK_THAT(message("ply\nend_header\n"), Contains("no 'format'"));
  CHECK_THAT(message("ply\nformat ascii 1.0\nproperty int x\nend_header\n"), Contains("line 3"));
  CHECK_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n"), Contains("'half'"));
  CHECK_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 9\nend_header\n0\n"),
             Contains("element 'face' has no properties"));
  CHECK_THAT(message("solid\n"), Contains("starts with 'ply'"));
}
