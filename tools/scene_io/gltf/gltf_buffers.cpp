#include <tools/scene_io/gltf/gltf_buffers.h>

#include <tools/base/errors.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/gltf/gltf_check.h>
#include <tools/scene_io/gltf/gltf_extensions.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <system_error>
#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_filled_by_decoder(const Json& buffer) {
  const auto extensions = buffer.find("extensions");
  return extensions != buffer.end() && extensions->is_object() && extensions->contains(kMeshopt);
}

build::Result<GltfBuffer> from_data_uri(const std::string& uri) {
  GltfBuffer bytes;
  std::string ignored;
  if (!tinygltf::IsDataURI(uri) || !tinygltf::DecodeDataURI(&bytes, ignored, uri, 0, false))
    return invalid_input("its data URI is empty, damaged or not base64");
  return bytes;
}

build::Result<GltfBuffer> from_file(const std::string& uri, const std::filesystem::path& folder,
                                    std::vector<std::string>& files) {
  const std::string name = decode_percents(uri);
  if (name.empty() || name.find('\0') != std::string::npos) return invalid_input("its 'uri' is not the name of a file");
  // What begins with a slash stays in the folder.
  const std::filesystem::path path = folder / std::filesystem::path(name).relative_path();
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    return fail(build::ErrorCode::kIo, path.string() + ": it is not a regular file");
  auto file = read_input(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  files.push_back(path.string());
  const auto bytes = std::as_const(*file).bytes();
  const auto* const first = reinterpret_cast<const unsigned char*>(bytes.data());
  return GltfBuffer(first, first + bytes.size());
}

build::Result<GltfBuffer> load(const Json& buffer, std::size_t number, std::span<const std::byte> file,
                               const std::filesystem::path& folder, std::vector<std::string>& files) {
  const auto uri = buffer.find("uri");
  if (uri != buffer.end()) {
    const auto& text = uri->get_ref<const std::string&>();
    return text.starts_with("data:") ? from_data_uri(text) : from_file(text, folder, files);
  }
  const auto chunk = gltf_binary_chunk(file);
  if (!chunk) return tl::unexpected(chunk.error());
  if (number != 0 || chunk->empty())
    return invalid_input(number != 0 ? "it has no 'uri'" : "it has no 'uri', and the file has no binary chunk");
  return GltfBuffer(chunk->begin(), chunk->end());
}

}  // namespace

std::string decode_percents(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_value(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_value(text[i + 2]) : -1;
    if (low >= 0) i += 2;
    result += low >= 0 ? static_cast<char>(high * 16 + low) : text[i];
  }
  return result;
}

build::Result<std::vector<GltfBuffer>> load_buffers(const Json& document, std::span<const std::byte> file,
                                                    const std::filesystem::path& folder,
                                                    std::vector<std::string>& files) {
  std::vector<GltfBuffer> result;
  const auto list = document.find("buffers");
  for (std::size_t i = 0; list != document.end() && i < list->size(); ++i) {
    const Json& buffer = (*list)[i];
    if (is_filled_by_decoder(buffer) && !buffer.contains("uri")) {
      result.emplace_back();
      continue;
    }
    const std::string label = "buffer " + std::to_string(i) + ": ";
    auto bytes = load(buffer, i, file, folder, files);
    if (!bytes) return fail(bytes.error().code, label + bytes.error().message);
    const auto wanted = buffer.value("byteLength", std::uint64_t{0});
    if (bytes->size() < wanted)
      return invalid_input(label + "truncated: its 'byteLength' is " + std::to_string(wanted) +
                           ", but there are only " + std::to_string(bytes->size()) + " bytes");
    bytes->resize(static_cast<std::size_t>(wanted));
    result.push_back(std::move(*bytes));
  }
  return result;
}

}  // namespace hiprt::tools
