#pragma once
/// The buffers of a glTF file.

#include <hiprt_build/error.h>

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

using GltfBuffer = std::vector<unsigned char>;

/// Decodes the percent-encoded bytes of a URI (RFC 3986, 2.1).
std::string decode_percents(std::string_view text);

/// Loads the buffers: of data URIs, of files, and the first one of the binary chunk of a .glb file. What a URI or file
/// has behind byteLength is left out. A buffer with the extension EXT_meshopt_compression and without uri is empty:
/// decoders fill what would be in it.
/// @param document checked by check_gltf(). @param file the whole .gltf or .glb file. @param folder where relative
/// names lead to. @param files receives the paths of files that were read.
/// @return kIo, or kInvalidInput with the buffer, the bytes wanted and the bytes found.
build::Result<std::vector<GltfBuffer>> load_buffers(const nlohmann::json& document, std::span<const std::byte> file,
                                                    const std::filesystem::path& folder,
                                                    std::vector<std::string>& files);

}  // namespace hiprt::tools
