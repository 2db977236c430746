#pragma once
/// A list of assets to build: hiprt_device/docs/DISTRIBUTED.md describes the format.

#include <tools/cli/build/build_command.h>

#include <string>
#include <string_view>
#include <vector>

namespace hiprt::tools {

/// One BVH: the geometries of its files, as bvhbuild builds them of a command line.
struct Asset {
  std::string name{};
  std::vector<std::string> meshes{}, shapes{};          ///< Paths, from the folder of the manifest.
  std::string quality{}, builder{}, target{}, nodes{};  ///< Words of the options; empty: as the command line says.
  double cost = 0;                                      ///< Bytes of its files, as a measure of its time.

  /// The command line with the asset's own options.
  BuildCommand command(const BuildCommand& defaults) const;
};

/// @param text of the document. @param path for messages, and to find the files.
/// @return kInvalidInput with path, location and what was expected.
build::Result<std::vector<Asset>> parse_manifest(std::string_view text, const std::string& path);

/// Fills the costs.
/// @return kIo with the location in the manifest if a file is missing or is none.
build::Result<void> measure_assets(std::vector<Asset>& assets, const std::string& path);

}  // namespace hiprt::tools
