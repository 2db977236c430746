#pragma once
/// What the reader of glTF does with extensions.

#include <tools/scene_io/ignored.h>

#include <hiprt_build/error.h>

#include <nlohmann/json_fwd.hpp>

#include <string_view>

namespace hiprt::tools {

inline constexpr std::string_view kDraco = "KHR_draco_mesh_compression";
inline constexpr std::string_view kMeshopt = "EXT_meshopt_compression";

/// Checks the extensions that a file requires. Everything else is checked later: a file of an unknown extension may
/// have values that only the extension explains.
/// @param document of any content.
/// @return kInvalidInput with the extension, what it is for, and what to do.
build::Result<void> check_required_extensions(const nlohmann::json& document);

/// Counts the extensions that are used and not read.
/// @param surfaces are materials read? Else their extensions do not count.
void add_ignored_extensions(const nlohmann::json& document, bool surfaces, Ignored& ignored);

}  // namespace hiprt::tools
