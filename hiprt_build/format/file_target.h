#pragma once
/// What reading and writing files share on all systems: messages, and the file that a write replaces. Internal.

#include <hiprt_build/error.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

namespace hiprt::build::file_detail {

/// @return the path: in UTF-8 on Windows, unchanged elsewhere.
inline std::string text_of(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

inline tl::unexpected<Error> io_error(std::string_view action, const std::filesystem::path& path,
                                      std::string_view reason) {
  return tl::unexpected(
      Error{ErrorCode::kIo, "cannot " + std::string(action) + " '" + text_of(path) + "': " + std::string(reason)});
}

/// The file that a write to @p path replaces. Links are followed, so that they stay links. Only regular files are
/// replaced: for root, a rename over /dev/null would succeed.
/// @param permitted permitted(path) is an error if the existing file may not be replaced.
template <class Permitted>
Result<std::filesystem::path> resolve_target(const std::filesystem::path& path, const Permitted& permitted) {
  if (!path.has_filename()) return io_error("write", path, "it names no file");
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) return io_error("write", path, "it is a directory");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return io_error("write", path, "it is not a regular file");
  if (std::filesystem::exists(status))
    if (Result<void> allowed = permitted(path); !allowed) return tl::unexpected(allowed.error());
  if (!std::filesystem::is_symlink(path, error)) return path;
  auto target = std::filesystem::canonical(path, error);
  if (error) return io_error("follow the link", path, error.message());
  return target;
}

inline std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// folder_of(@p path), which must exist.
inline Result<std::filesystem::path> existing_folder_of(const std::filesystem::path& path,
                                                        const std::filesystem::path& target) {
  std::filesystem::path folder = folder_of(target);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    return io_error("write", path, "there is no folder '" + text_of(folder) + "'");
  return folder;
}

}  // namespace hiprt::build::file_detail
