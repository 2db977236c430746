#include <tests/tools/load.h>

#include <zstd.h>

#include <limits>
#include <memory>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

const Positions kPositions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, std::numeric_limits<float>::infinity()}};
const Triangles kTriangles{{0, 1, 2}, {1, 1, 2}, {1, 3, 2}};

std::string raw(std::uint32_t vertices = 4, std::uint32_t triangles = 3) {
  std::string bytes;
  append(bytes, vertices, triangles);
  for (const auto& p : kPositions) append(bytes, p[0], p[1], p[2]);
  for (const auto& t : kTriangles) append(bytes, t[0], t[1], t[2]);
  return bytes;
}

std::string compressed(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), 3);
  REQUIRE(ZSTD_isError(size) == 0);
  result.resize(size);
  return result;
}

/// With a checksum behind the last block.
std::string with_checksum(const std::string& bytes) {
  const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress2(context.get(), result.data(), result.size(), bytes.data(), bytes.size());
  REQUIRE(ZSTD_isError(size) == 0);
  result.resize(size);
  return result;
}

}  // namespace

TEST_CASE("Raw meshes: plain, compressed, in several frames, compressed without the extension") {
  const TempFolder folder;
  const std::string bytes = raw();
  for (const auto& path :
       {folder.write("a.mesh", bytes), folder.write("a.mesh.zst", compressed(bytes)),
        folder.write("b.mesh", compressed(bytes)),
        folder.write("c.MESH.ZST", compressed(bytes.substr(0, 30)) + compressed(bytes.substr(30)))}) {
    const auto mesh = load(path);
    CHECK(mesh.positions == kPositions);
    CHECK(mesh.triangles == kTriangles);
  }
}

TEST_CASE("Raw meshes: an empty mesh and one larger than a reading step") {
  const TempFolder folder;
  std::string bytes;
  append(bytes, 0u, 0u);
  CHECK(load(folder.write("e.mesh", bytes)).triangles.empty());
  CHECK(load(folder.write("e.mesh.zst", compressed(bytes))).triangles.empty());
  bytes.clear();
  const std::uint32_t count = 1'500'000;
  append(bytes, count, 1u);
  for (std::uint32_t i = 0; i < count; ++i) append(bytes, static_cast<float>(i), 0.0f, 1.0f);
  append(bytes, 0u, 1u, count - 1);
  const auto mesh = load(folder.write("l.mesh.zst", compressed(bytes)));
  REQUIRE(mesh.positions.size() == count);
  CHECK(mesh.positions[count - 1] == build::Position{static_cast<float>(count - 1), 0, 1});
}

TEST_CASE("Raw meshes: a zstd frame ends with its checksum, or is refused") {
  const TempFolder folder;
  const std::string packed = with_checksum(raw());
  CHECK(load(folder.write("a.mesh.zst", packed)).triangles == kTriangles);
  CHECK(load(folder.write("b.mesh.zst", with_checksum(raw().substr(0, 50)) + compressed(raw().substr(50)))).triangles ==
        kTriangles);
  for (std::size_t missing = 1; missing <= 4; ++missing)
    CHECK_THAT(refusal(folder.write("cut.mesh.zst", packed.substr(0, packed.size() - missing))),
               Contains("truncated") && Contains("zstd frame"));
  std::string wrong = packed;
  wrong.back() = static_cast<char>(~wrong.back());
  CHECK_THAT(refusal(folder.write("wrong.mesh.zst", wrong)), Contains("checksum"));
}

TEST_CASE("Raw meshes: sizes that do not fit, damaged and truncated data, indices past the vertices are refused") {
  const TempFolder folder;
  const std::string whole = raw(), packed = compressed(whole);
  for (std::size_t size = 1; size < whole.size(); ++size) refusal(folder.write("cut.mesh", whole.substr(0, size)));
  for (std::size_t size = 5; size < packed.size(); ++size)
    refusal(folder.write("cut.mesh.zst", packed.substr(0, size)));
  CHECK_THAT(refusal(folder.write("a.mesh", whole + "x")), Contains("92 bytes") && Contains("93"));
  CHECK_THAT(refusal(folder.write("a.mesh.zst", compressed(whole + "x"))), Contains("behind the 3 triangles"));
  CHECK_THAT(refusal(folder.write("a.mesh", raw(0xffffffffu, 0xffffffffu))), Contains("103079215088 bytes"));
  CHECK_THAT(refusal(folder.write("a.mesh.zst", compressed(raw(0xffffffffu, 3)))),
             Contains("4294967295 vertices") && Contains("ends in number 7"));
  CHECK_THAT(refusal(folder.write("a.mesh.zst", "hello, I am no zstd")), Contains("bytes"));
  std::string broken = packed;
  broken[broken.size() / 2] = static_cast<char>(~broken[broken.size() / 2]);
  broken[6] = static_cast<char>(~broken[6]);
  refusal(folder.write("a.mesh.zst", broken));
  std::string index = whole;
  index.replace(index.size() - 4, 4, "\xff\xff\xff\xff");
  CHECK_THAT(refusal(folder.write("a.mesh", index)),
             Contains("triangle 2") && Contains("vertex 4294967295") && Contains("only 4"));
}
