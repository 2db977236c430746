#include <hiprt_build/rtc/bitcode.h>

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

namespace hiprt::gpu::rtc {

namespace {

using build::Error;
using build::ErrorCode;
using build::Result;

tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected(Error{code, "bitcode: " + std::move(message)});
}
tl::unexpected<Error> invalid(std::string message) { return fail(ErrorCode::kInvalidInput, std::move(message)); }

/// Bundles begin with this. Then follow the number of entries and for each: offset, size, length of the name, name. See
/// clang's documentation, "Clang Offload Bundler".
constexpr std::string_view kBundle = "__CLANG_OFFLOAD_BUNDLE__";
constexpr std::string_view kCompressedBundle = "CCOB";
/// Before the processor in the name of an entry: kind of program, then the target.
constexpr std::string_view kTarget = "-amdgcn-amd-amdhsa-";

/// Reads a bundle's table. After an error it returns zeros and empty texts.
class TableReader {
 public:
  explicit TableReader(std::string_view left) : left_(left) {}
  std::uint64_t number() {
    std::uint64_t value = 0;
    if (const std::string_view bytes = text(sizeof value); !bytes.empty())
      std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view text(std::uint64_t size) {
    if (size > left_.size()) failed_ = true;
    if (failed_) return {};
    const std::string_view result = left_.substr(0, size);
    left_.remove_prefix(size);
    return result;
  }
  bool failed() const { return failed_; }

 private:
  std::string_view left_;
  bool failed_ = false;
};

/// @return the processor in the name of an entry: "gfx90a" of "hip-amdgcn-amd-amdhsa--gfx90a:xnack-". Empty for the
/// host's entry.
std::string_view processor_of(std::string_view name) {
  const std::size_t target = name.find(kTarget);
  if (target == std::string_view::npos) return {};
  name.remove_prefix(target + kTarget.size());
  if (name.starts_with('-')) name.remove_prefix(1);  // An empty environment.
  return name.substr(0, name.find(':'));
}

bool is_bitcode(std::string_view text) {
  constexpr std::string_view kPlain = "BC\xc0\xde", kWrapped = "\xde\xc0\x17\x0b";
  return text.starts_with(kPlain) || text.starts_with(kWrapped);
}

Result<std::string_view> find_entry(std::string_view bundle, std::string_view processor) {
  TableReader table(bundle.substr(kBundle.size()));
  std::string others;
  for (std::uint64_t left = table.number(); left != 0 && !table.failed(); --left) {
    const std::uint64_t offset = table.number(), size = table.number();
    const std::string_view found = processor_of(table.text(table.number()));
    if (found == processor) {
      if (offset > bundle.size() || size > bundle.size() - offset) return invalid("the bundle is cut off");
      return bundle.substr(offset, size);
    }
    if (!found.empty()) others.append(" ").append(found);
  }
  if (table.failed()) return invalid("the bundle is cut off");
  return invalid("the bundle has no entry for " + std::string(processor) + ", but for:" + others);
}

}  // namespace

Result<std::span<const std::byte>> find_bitcode(std::span<const std::byte> code, std::string_view processor) {
  std::string_view text(reinterpret_cast<const char*>(code.data()), code.size());
  if (text.starts_with(kCompressedBundle))
    return invalid("a compressed bundle cannot be read (compile with --no-offload-compress)");
  if (text.starts_with(kBundle)) {
    const auto entry = find_entry(text, processor);
    if (!entry) return tl::unexpected(entry.error());
    text = *entry;
  }
  if (!is_bitcode(text)) return invalid("it is neither LLVM bitcode nor a bundle (compile with -fgpu-rdc -emit-llvm)");
  return std::as_bytes(std::span(text));
}

Result<MemoryFile> MemoryFile::make(std::span<const std::byte> bytes) {
  MemoryFile file(memfd_create("hiprt", MFD_CLOEXEC));
  const auto reason = [] { return std::system_category().message(errno); };
  if (file.descriptor_ < 0) return fail(ErrorCode::kIo, "memfd_create: " + reason());
  while (!bytes.empty()) {
    const ssize_t written = write(file.descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return fail(ErrorCode::kIo, "write: " + reason());
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return file;
}

MemoryFile::MemoryFile(MemoryFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
MemoryFile::~MemoryFile() {
  if (descriptor_ >= 0) close(descriptor_);
}
std::string MemoryFile::path() const {
  return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(descriptor_);
}

}  // namespace hiprt::gpu::rtc
