#pragma once
/// Questions to parts of a scene (rays), their answers (hits), and the messages that have them.

#include <tools/render/scene/path_surface.h>
#include <tools/render/tracers/tracer.h>

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// The closest hit in a part, and its surface.
struct PartHit {
  Hit hit;
  Vec3 geometric, normal, base_color;  ///< As in PathSurface.
  TextureCoordinates coordinates;
  float metallic, roughness;
};

/// @pre The surface emits no light: only the shared part has such surfaces.
inline PathSurface surface_of(const PartHit& hit) {
  PathSurface surface;
  surface.geometric = hit.geometric;
  surface.normal = hit.normal;
  surface.coordinates = hit.coordinates;
  surface.base_color = hit.base_color;
  surface.metallic = hit.metallic;
  surface.roughness = hit.roughness;
  return surface;
}

enum class VisitResult : std::uint8_t { kMiss, kHit, kFailed };

/// The answers to a batch of rays, in their order.
struct PartAnswer {
  Query query = Query::kClosest;  ///< Of the question.
  std::vector<VisitResult> results;
  // Only for Query::kClosest and for rays with kHit.
  std::vector<PartHit> hits;
  std::vector<std::uint32_t> paths;  ///< `levels` numbers per hit (instance_paths.h). The first is that of the scene.
};

/// Rays that are sent to a part. They have tmin 0 and all bits of the mask.
struct PartQuestion {
  std::uint32_t part = 0;
  std::uint32_t slot = 0;    ///< Where the sender waits.
  std::uint32_t number = 0;  ///< Of the sender's questions.
  Query query = Query::kClosest;
  std::vector<Ray> rays;
};

/// Bytes of a ray in a question, and of its answer at most.
inline constexpr std::size_t kQuestionRayBytes = 32;
constexpr std::size_t answer_ray_bytes(std::uint32_t levels) { return 1 + sizeof(PartHit) + 4 * levels; }

std::vector<std::byte> encode(const PartQuestion& question);
/// @return kInvalidInput for bytes that are no question to one of @p parts parts.
build::Result<PartQuestion> decode_question(std::span<const std::byte> bytes, std::size_t parts);

/// @param number of the question.
std::vector<std::byte> encode(std::uint32_t number, const PartAnswer& answer);
/// An answer that says why there is none.
std::vector<std::byte> encode_fault(std::uint32_t number, const build::Error& error);

struct NumberedAnswer {
  std::uint32_t number = 0;
  PartAnswer answer;
};
/// @return the error of encode_fault(); kInvalidInput for malformed bytes.
build::Result<NumberedAnswer> decode_answer(std::span<const std::byte> bytes, std::uint32_t levels);

}  // namespace hiprt::tools
