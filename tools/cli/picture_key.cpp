#include <tools/cli/picture_key.h>

#include <tools/base/digest.h>

#include <span>

namespace hiprt::tools {
namespace {

/// The checksum of all arrays of the path tracer: materials, textures, lights and sky.
std::string checksum_of(const PathData& data) {
  Digester digester;
  PathData::for_each(data, data, [&](const auto& array, const auto&) {
    const std::uint64_t size = array.size();
    digester.add(std::as_bytes(std::span(&size, 1)));
    digester.add(std::as_bytes(std::span(array)));
  });
  return to_text(digester.get());
}

}  // namespace

PictureKey picture_key(const std::string& version, std::span<const std::byte> scene, const RenderCommand& command,
                       const Camera& camera) {
  PictureKey key{{"program", version},
                 {"scene", to_text(digest_of(scene))},
                 {"size", command.size},
                 {"spp", std::to_string(command.render.samples)},
                 {"camera", to_text(camera)},
                 {"mode", command.mode_text()},
                 {"shutter", command.shutter},
                 {"seed", std::to_string(command.render.seed)},
                 {"layers", command.render.layers ? "yes" : "no"}};
  if (command.paths.chosen()) {
    key.emplace_back("bounces", std::to_string(command.paths.bounces()));
    key.emplace_back("materials and sky", checksum_of(command.paths.data()));
  } else if (command.render.mode == RenderMode::kAo) {
    key.emplace_back("ao-distance", std::to_string(command.render.ao_distance));
  }
  return key;
}

}  // namespace hiprt::tools
