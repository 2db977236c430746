#include <hiprt_build/file.h>
#include <hiprt_build/format/file_target.h>
#include <hiprt_build/format/out_of_memory.h>

#if !defined(NOMINMAX)
#define NOMINMAX  // GCC's headers define it.
#endif
#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace hiprt::build {

namespace {

using namespace file_detail;

/// Closes a handle when it goes out of scope.
class Handle {
 public:
  explicit Handle(HANDLE handle) : handle_(handle == INVALID_HANDLE_VALUE ? nullptr : handle) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { static_cast<void>(close()); }

  HANDLE get() const { return handle_; }
  explicit operator bool() const { return handle_ != nullptr; }
  bool close() { return handle_ == nullptr || ::CloseHandle(std::exchange(handle_, nullptr)) != 0; }

 private:
  HANDLE handle_;
};

tl::unexpected<Error> system_error(std::string_view action, const std::filesystem::path& path) {
  return io_error(action, path, std::system_category().message(static_cast<int>(::GetLastError())));
}

/// Whether an existing file may be replaced.
Result<void> permitted(const std::filesystem::path& path) {
  const DWORD attributes = ::GetFileAttributesW(path.c_str());
  if (attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_READONLY) != 0)
    return io_error("write", path, "it is read-only");
  return {};
}

bool write_all(HANDLE file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    DWORD written = 0;
    const DWORD size = static_cast<DWORD>(std::min<std::size_t>(bytes.size(), std::size_t{1} << 30));
    if (::WriteFile(file, bytes.data(), size, &written, nullptr) == 0) return false;
    bytes = bytes.subspan(written);
  }
  return true;
}

/// Creates a file in @p folder. @return its handle, or INVALID_HANDLE_VALUE with the system's error.
HANDLE create_temporary(const std::filesystem::path& folder, std::filesystem::path& name) {
  static std::atomic<std::uint32_t> counter{0};
  constexpr int kAttempts = 100;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    name = folder / (".hiprt-" + std::to_string(::GetCurrentProcessId()) + "-" + std::to_string(counter++) + ".tmp");
    HANDLE file = ::CreateFileW(name.c_str(), GENERIC_WRITE, 0, nullptr, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (file != INVALID_HANDLE_VALUE || ::GetLastError() != ERROR_FILE_EXISTS) return file;
  }
  return INVALID_HANDLE_VALUE;
}

/// Fills the temporary file and renames it.
/// @return what failed, or nullptr; GetLastError() has the reason.
const char* fill_and_rename(Handle& file, const std::filesystem::path& temporary, const std::filesystem::path& target,
                            std::span<const std::byte> bytes) {
  if (!write_all(file.get(), bytes)) return "write";
  if (::FlushFileBuffers(file.get()) == 0) return "flush";
  if (!file.close()) return "close";
  if (::MoveFileExW(temporary.c_str(), target.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) == 0)
    return "replace";
  return nullptr;
}

}  // namespace

Result<Buffer> map_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) return io_error("map", path, "it is a directory");
  const Handle file(::CreateFileW(path.c_str(), GENERIC_READ, FILE_SHARE_READ, nullptr, OPEN_EXISTING,
                                  FILE_ATTRIBUTE_NORMAL, nullptr));
  if (!file) return system_error("open", path);
  if (::GetFileType(file.get()) != FILE_TYPE_DISK) return io_error("map", path, "it is not a regular file");
  LARGE_INTEGER size{};
  if (::GetFileSizeEx(file.get(), &size) == 0) return system_error("examine", path);
  if (size.QuadPart == 0) return io_error("map", path, "it is empty");
  const Handle mapping(::CreateFileMappingW(file.get(), nullptr, PAGE_READONLY, 0, 0, nullptr));
  if (!mapping) return system_error("map", path);
  // The view keeps the mapping and the file open.
  void* data = ::MapViewOfFile(mapping.get(), FILE_MAP_READ, 0, 0, 0);
  if (data == nullptr) return system_error("map", path);
  return Buffer(static_cast<std::byte*>(data), static_cast<std::size_t>(size.QuadPart),
                [](std::byte* start, std::size_t) { ::UnmapViewOfFile(start); });
}

// Windows lets nobody write to a file or shorten it while this process maps it without FILE_SHARE_WRITE.
Result<Buffer> read_file(const std::filesystem::path& path, const ParallelLoop& loop) {
  return or_out_of_memory("to read the file", [&]() -> Result<Buffer> {
    const Result<Buffer> mapped = map_file(path);
    if (!mapped) return tl::unexpected(mapped.error());
    Buffer buffer = Buffer::uninitialized(mapped->size());
    constexpr std::size_t kPart = std::size_t{16} << 20;
    run_loop(loop, (buffer.size() + kPart - 1) / kPart, [&](std::size_t part) {
      const auto from = mapped->bytes().subspan(part * kPart);
      std::copy_n(from.begin(), std::min(from.size(), kPart), buffer.bytes().subspan(part * kPart).begin());
    });
    return buffer;
  });
}

Result<void> check_writable(const std::filesystem::path& path) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  const auto folder = existing_folder_of(path, *target);
  if (!folder) return tl::unexpected(folder.error());
  // Windows knows whether a file can be created only when one is.
  std::filesystem::path temporary;
  Handle file(create_temporary(*folder, temporary));
  if (!file) return system_error("create a temporary file beside", path);
  static_cast<void>(file.close());
  ::DeleteFileW(temporary.c_str());
  return {};
}

Result<void> write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const auto target = resolve_target(path, permitted);
  if (!target) return tl::unexpected(target.error());
  std::filesystem::path temporary;
  Handle file(create_temporary(folder_of(*target), temporary));
  if (!file) return system_error("create a temporary file beside", path);
  if (const char* failed = fill_and_rename(file, temporary, *target, bytes)) {
    auto error = system_error(failed, path);
    static_cast<void>(file.close());
    ::DeleteFileW(temporary.c_str());
    return error;
  }
  return {};
}

}  // namespace hiprt::build
