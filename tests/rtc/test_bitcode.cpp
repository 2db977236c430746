// LLVM bitcode of AMD: which bytes are it, and what a damaged file does.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/rtc/bitcode.h>

#include <tests/catch.h>
#include <tests/oracle/random.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

using namespace hiprt;
using build::ErrorCode;
using Catch::Matchers::Contains;

namespace {

constexpr std::uint64_t kSeed = 20261127;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string bundle_of(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string table = "__CLANG_OFFLOAD_BUNDLE__", code;
  const auto number = [&table](std::uint64_t value) {
    char text[sizeof value];
    std::memcpy(text, &value, sizeof value);
    table.append(text, sizeof value);
  };
  std::size_t size = table.size() + 8;
  for (const auto& [name, content] : entries) size += 24 + name.size();
  number(entries.size());
  for (const auto& [name, content] : entries) {
    number(size + code.size());
    number(content.size());
    number(name.size());
    table += name;
    code += content;
  }
  return table + code;
}

const std::string kCode = "BC\xc0\xde of gfx90a", kOther = "BC\xc0\xde of gfx1030";
const std::string kBundle = bundle_of({{"host-x86_64-unknown-linux--", ""},
                                       {"hip-amdgcn-amd-amdhsa--gfx90a:xnack-", kCode},
                                       {"hipv4-amdgcn-amd-amdhsa--gfx1030", kOther}});

}  // namespace

TEST_CASE("bitcode is taken as it is, or out of a bundle") {
  const auto find = [](const std::string& code, const char* processor) {
    const auto found = gpu::rtc::find_bitcode(bytes_of(code), processor);
    INFO((found ? std::string() : found.error().message));
    REQUIRE(found);
    return std::string(reinterpret_cast<const char*>(found->data()), found->size());
  };
  CHECK(find(kCode, "gfx1030") == kCode);
  CHECK(find(kBundle, "gfx90a") == kCode);
  CHECK(find(kBundle, "gfx1030") == kOther);
}

TEST_CASE("other bytes are refused with the reason") {
  const auto refused = [](const std::string& code) {
    const auto found = gpu::rtc::find_bitcode(bytes_of(code), "gfx1100");
    REQUIRE_FALSE(found);
    CHECK(found.error().code == ErrorCode::kInvalidInput);
    return found.error().message;
  };
  CHECK_THAT(refused(""), Contains("neither LLVM bitcode nor a bundle"));
  CHECK_THAT(refused("\x7f"
                     "ELF"),
             Contains("neither LLVM bitcode nor a bundle"));
  CHECK_THAT(refused("CCOB\1\2"), Contains("compressed"));
  CHECK_THAT(refused(kBundle), Contains("no entry for gfx1100, but for: gfx90a gfx1030"));
  CHECK_THAT(refused(bundle_of({{"hip-amdgcn-amd-amdhsa--gfx1100",
                                 "\x7f"
                                 "ELF"}})),
             Contains("neither"));
}

TEST_CASE("damaged bundles read no byte outside") {
  oracle::Random random(kSeed);
  for (std::size_t size = 0; size < kBundle.size(); ++size)
    static_cast<void>(gpu::rtc::find_bitcode(bytes_of(std::string(kBundle.data(), size)), "gfx1030"));
  for (int i = 0; i < 20000; ++i) {
    std::string damaged = kBundle;
    for (int n = 0; n < 3; ++n) damaged[24 + random.below(120)] = static_cast<char>(random.below(256));
    const auto found = gpu::rtc::find_bitcode(bytes_of(damaged), "gfx1030");
    if (!found) continue;
    const auto* const end = reinterpret_cast<const std::byte*>(damaged.data() + damaged.size());
    REQUIRE(found->data() >= bytes_of(damaged).data());
    REQUIRE(found->size() <= static_cast<std::size_t>(end - found->data()));
  }
}

TEST_CASE("a file in memory has a name while it lives") {
  std::string path;
  {
    const auto file = gpu::rtc::MemoryFile::make(bytes_of(kCode));
    REQUIRE(file);
    path = file->path();
    std::ifstream stream(path, std::ios::binary);
    CHECK(std::string(std::istreambuf_iterator<char>(stream), {}) == kCode);
  }
  CHECK_FALSE(std::ifstream(path));
}

TEST_CASE("bitcode that a compiler cannot use is an error") {
  gpu::CompileOptions options{.architecture = "sm_90", .cached = false};
  options.bitcode = bytes_of(kCode);
  const auto other = gpu::compile_kernels("\n", {}, options);
  REQUIRE_FALSE(other);
  CHECK_THAT(other.error().message, Contains("bitcode is for AMD"));
  options.architecture = "gfx1030";
  for (const std::string& code : {kOther, kBundle, std::string("no code")}) {
    options.bitcode = bytes_of(code);
    const auto kernels = gpu::compile_kernels("\n", {}, options);
    REQUIRE_FALSE(kernels);
    if (kernels.error().code == ErrorCode::kBackend) continue;  // hipRTC is not here.
    CHECK(kernels.error().code == ErrorCode::kInvalidInput);
    CHECK_THAT(kernels.error().message, Contains("itcode"));
  }
}
