#pragma once
/// glTF 2.0's metallic-roughness material (appendix B): a diffuse base below the GGX microfacets of a dielectric or
/// metal. One difference: the base gets the light that the surface transmits, on entry and on exit (Shirley et al., "A
/// practitioners' assessment of light reflection models", 1997). With the standard's formula, white smooth bases
/// reflect more light than arrives.

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

  /// @return the fraction of light from @p wi that goes to wo, times the cosine.
  HIPRT_HD Vec3 value(const Vec3& wi) const {
    if (!(wi.z > 0.0f && wo_.z > 0.0f)) return Vec3(0.0f);
    const Vec3 h = unit_or_zero(wo_ + wi);
    const Vec3 f = fresnel(glm::dot(wi, h));
    const Vec3 mirrored = f * (distribution(h) * visibility(wi));
    // Divides by the integral of let_in() over all directions, weighted by their cosine.
    constexpr float kMean = kPi * (1.0f - kDielectric) * 20.0f / 21.0f;
    const Vec3 base = diffuse_ * (let_in(wo_.z) * let_in(wi.z) / kMean);
    return (mirrored + base) * wi.z;
  }

  /// Probability density of sample(), per solid angle.
  HIPRT_HD float density(const Vec3& wi) const {
    if (!(wi.z > 0.0f && wo_.z > 0.0f)) return 0.0f;
    const Vec3 h = unit_or_zero(wo_ + wi);
    // Density of the normals visible from wo: G1(wo) D(h) max(0, wo h) / wo.z. Of directions: divided by 4 wo h.
    const float mirrored = masking(wo_) * distribution(h) / (4.0f * wo_.z);
    return mirror_part_ * mirrored + (1.0f - mirror_part_) * wi.z * (1.0f / kPi);
  }

  /// @return a random direction. @param lobe, u, v random numbers in [0, 1).
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
  /// Schlick's approximation.
  HIPRT_HD Vec3 fresnel(float cosine) const { return specular_ + (Vec3(1.0f) - specular_) * grazing(cosine); }
  /// The fraction of light that a dielectric transmits.
  HIPRT_HD static float let_in(float cosine) { return (1.0f - kDielectric) * (1.0f - grazing(cosine)); }
  HIPRT_HD static float min_of(float a, float b) { return a < b ? a : b; }
  /// The GGX distribution of microfacet normals.
  HIPRT_HD float distribution(const Vec3& h) const {
    const float squared = alpha_ * alpha_;
    // cos^2 (a^2 - 1) + 1, without cancellation for smooth surfaces.
    const float d = h.x * h.x + h.y * h.y + squared * h.z * h.z;
    return squared / (kPi * d * d);
  }
  /// Smith's masking and shadowing for both directions, divided by 4 wi.z wo.z.
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
