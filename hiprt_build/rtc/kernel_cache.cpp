#include <hiprt_build/file.h>
#include <hiprt_build/rtc/kernel_cache.h>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace hiprt::gpu::rtc {

namespace {

/// First bytes of a file. The digits are the version of what follows: a checksum of the rest, the key, and texts, each
/// with its length before it.
constexpr std::string_view kMagic = "hiprtk01";
constexpr std::size_t kRest = kMagic.size() + sizeof(std::uint64_t);

class Writer {
 public:
  void number(std::uint64_t value) { bytes(&value, sizeof value); }
  void text(std::string_view value) {
    number(value.size());
    bytes(value.data(), value.size());
  }
  std::vector<std::byte> content;

 private:
  void bytes(const void* data, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(data);
    content.insert(content.end(), first, first + size);
  }
};

/// Reads what a Writer has written. After an error it returns zeros and empty texts.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> content) : left_(content) {}
  std::uint64_t number() {
    std::uint64_t value = 0;
    if (left_.size() < sizeof value) return fail(), 0;
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return value;
  }
  std::string_view text() {
    const std::uint64_t size = number();
    if (size > left_.size()) return fail(), std::string_view();
    const std::string_view value(reinterpret_cast<const char*>(left_.data()), size);
    left_ = left_.subspan(size);
    return value;
  }
  bool is_complete() const { return !failed_ && left_.empty(); }
  bool failed() const { return failed_; }

 private:
  void fail() {
    failed_ = true;
    left_ = {};
  }
  std::span<const std::byte> left_;
  bool failed_ = false;
};

std::filesystem::path file_of(const std::filesystem::path& folder, const std::string& key) {
  return folder / (key + ".kernels");
}

}  // namespace

void KernelKey::add(std::string_view text) {
  add(text.size());
  content_ += text;
}
void KernelKey::add(std::size_t count) { content_ += std::to_string(count) + ' '; }
std::string KernelKey::text() const {
  const XXH128_hash_t hash = XXH3_128bits(content_.data(), content_.size());
  std::array<char, 33> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                static_cast<unsigned long long>(hash.low64));
  return digits.data();
}

std::filesystem::path cache_folder(const CompileOptions& options) {
  if (!options.cache.empty()) return options.cache;
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  // The XDG Base Directory Specification: paths that are not absolute do not count.
  const std::filesystem::path base = variable("XDG_CACHE_HOME"), home = variable("HOME");
  if (base.is_absolute()) return base / "hiprt/kernels";
  return home.is_absolute() ? home / ".cache/hiprt/kernels" : std::filesystem::path();
}

std::optional<CompiledKernels> read_cached(const std::filesystem::path& folder, const std::string& key) {
  const auto file = build::read_file(file_of(folder, key));
  if (!file) return {};
  const std::span<const std::byte> bytes = file->bytes();
  std::uint64_t checksum = 0;
  if (bytes.size() < kRest || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) return {};
  std::memcpy(&checksum, bytes.data() + kMagic.size(), sizeof checksum);
  if (checksum != XXH3_64bits(bytes.data() + kRest, bytes.size() - kRest)) return {};
  Reader reader(bytes.subspan(kRest));
  if (reader.text() != key) return {};
  CompiledKernels kernels;
  const auto code = std::as_bytes(std::span(reader.text()));
  kernels.code.assign(code.begin(), code.end());
  kernels.log = reader.text();
  for (std::uint64_t left = reader.number(); left != 0 && !reader.failed(); --left)
    kernels.names.emplace_back(reader.text());
  if (!reader.is_complete()) return {};
  kernels.from_cache = true;
  return kernels;
}

void write_cached(const std::filesystem::path& folder, const std::string& key, const CompiledKernels& kernels) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return;
  Writer rest;
  rest.text(key);
  rest.text({reinterpret_cast<const char*>(kernels.code.data()), kernels.code.size()});
  rest.text(kernels.log);
  rest.number(kernels.names.size());
  for (const std::string& name : kernels.names) rest.text(name);
  const std::uint64_t checksum = XXH3_64bits(rest.content.data(), rest.content.size());
  std::vector<std::byte> file(kRest);
  std::memcpy(file.data(), kMagic.data(), kMagic.size());
  std::memcpy(file.data() + kMagic.size(), &checksum, sizeof checksum);
  file.insert(file.end(), rest.content.begin(), rest.content.end());
  static_cast<void>(build::write_file(file_of(folder, key), file));
}

}  // namespace hiprt::gpu::rtc
