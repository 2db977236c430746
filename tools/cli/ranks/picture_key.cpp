#include <tools/cli/ranks/picture_key.h>

#include <tools/base/digest.h>
#include <tools/render/path/path_data_bytes.h>

namespace hiprt::tools {
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
    key.emplace_back("materials and sky", to_text(digest_of(command.paths.data())));
  } else if (command.render.mode == RenderMode::kAo) {
    key.emplace_back("ao-distance", std::to_string(command.render.ao_distance));
  }
  return key;
}

}  // namespace hiprt::tools
