#pragma once
/// glTF 2.0's metallic-roughness material (appendix B): a diffuse base below a dielectric's or metal's GGX microfacets.
/// But the base gets what the surface lets through on both ways (Shirley et al., "A practitioners' assessment of light
/// reflection models", 1997): by the standard's formula white smooth bases send out more light than arrives.

#include <tools/render/scene/frame.h>
#include <tools/render/scene/path_surface.h>

#include <hiprt_device/math/vec_functions.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// In the frame of the shading normal: z is up, both directions point away from the surface.
class Bsdf {
 public:
  HIPRT_HD explicit Bsdf(const PathSurface& surface, const Vec3& wo)
      : wo_(wo), diffuse_(surface.base_color * (1.0f - surface.metallic)) {
    constexpr float kSmoothest = 1e-3f;
    alpha_ = max_of(surface.roughness * surface.roughness, kSmoothest);
    specular_ = Vec3(kDielectric) * (1.0f - surface.metallic) + surface.base_color * surface.metallic;
    const Vec3 mirrored = fresnel(wo.z);
    const float mirror = mirrored.x + mirrored.y + mirrored.z, base = diffuse_.x + diffuse_.y + diffuse_.z;
    mirror_part_ = base > 0.0f ? max_of(mirror / (mirror + base), 0.1f) : 1.0f;
  }

  /// How much of the light from @p wi goes to wo, times the cosine.
  HIPRT_HD Vec3 value(const Vec3& wi) const {
    if (!(wi.z > 0.0f && wo_.z > 0.0f)) return Vec3(0.0f);
    const Vec3 h = unit_or_zero(wo_ + wi);
    const Vec3 f = fresnel(glm::dot(wi, h));
    const Vec3 mirrored = f * (distribution(h) * visibility(wi));
    // Over the mean of let_in() over all directions, by their cosine.
    constexpr float kMean = kPi * (1.0f - kDielectric) * 20.0f / 21.0f;
    const Vec3 base = diffuse_ * (let_in(wo_.z) * let_in(wi.z) / kMean);
    return (mirrored + base) * wi.z;
  }

  /// Of sample(), per solid angle.
  HIPRT_HD float density(const Vec3& wi) const {
    if (!(wi.z > 0.0f && wo_.z > 0.0f)) return 0.0f;
    const Vec3 h = unit_or_zero(wo_ + wi);
    // Of normals that wo sees: G1(wo) D(h) max(0, wo h) / wo.z; of directions: that over 4 wo h.
    const float mirrored = masking(wo_) * distribution(h) / (4.0f * wo_.z);
    return mirror_part_ * mirrored + (1.0f - mirror_part_) * wi.z * (1.0f / kPi);
  }

  /// @param lobe, u, v in [0, 1).
  HIPRT_HD Vec3 sample(float lobe, float u, float v) const {
    if (!(lobe < mirror_part_)) return cosine_direction(u, v);
    // A normal that is visible from wo (Dupuy and Benyoub, "Sampling visible GGX normals with spherical caps", 2023).
    const Vec3 stretched = unit_or_zero(Vec3(alpha_ * wo_.x, alpha_ * wo_.y, wo_.z));
    const float z = (1.0f - u) * (1.0f + stretched.z) - stretched.z;
    const float radius = std::sqrt(max_of(1.0f - z * z, 0.0f));
    const SinCos angle = sin_cos_of_turn(v);
    const Vec3 sum = Vec3(radius * angle.cosine, radius * angle.sine, z) + stretched;
    const Vec3 h = unit_or_zero(Vec3(alpha_ * sum.x, alpha_ * sum.y, sum.z));
    return h * (2.0f * glm::dot(wo_, h)) - wo_;
  }

 private:
  static constexpr float kDielectric = 0.04f;

  /// (1 - cosine)^5
  HIPRT_HD static float grazing(float cosine) {
    const float c = 1.0f - min_of(max_of(cosine, 0.0f), 1.0f), cc = c * c;
    return cc * cc * c;
  }
  /// Schlick's.
  HIPRT_HD Vec3 fresnel(float cosine) const { return specular_ + (Vec3(1.0f) - specular_) * grazing(cosine); }
  /// What a dielectric does not mirror.
  HIPRT_HD static float let_in(float cosine) { return (1.0f - kDielectric) * (1.0f - grazing(cosine)); }
  HIPRT_HD static float min_of(float a, float b) { return a < b ? a : b; }
  /// GGX.
  HIPRT_HD float distribution(const Vec3& h) const {
    const float squared = alpha_ * alpha_;
    // cos^2 (a^2 - 1) + 1 without what cancels for smooth surfaces.
    const float d = h.x * h.x + h.y * h.y + squared * h.z * h.z;
    return squared / (kPi * d * d);
  }
  /// Smith's, of both directions, over 4 wi.z wo.z.
  HIPRT_HD float visibility(const Vec3& wi) const { return 0.5f / (wo_.z * length(wi) + wi.z * length(wo_)); }
  HIPRT_HD float masking(const Vec3& w) const { return 2.0f * w.z / (w.z + length(w)); }
  HIPRT_HD float length(const Vec3& w) const {
    const float squared = alpha_ * alpha_;
    return std::sqrt(w.z * w.z + squared * (w.x * w.x + w.y * w.y));
  }

  Vec3 wo_, diffuse_, specular_;
  float alpha_, mirror_part_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
