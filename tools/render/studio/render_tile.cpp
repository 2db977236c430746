#include <tools/render/studio/render_tile.h>

#include <tools/base/interrupt.h>
#include <tools/render/image/color.h>
#include <tools/render/scene/frame.h>
#include <tools/render/studio/sampler.h>
#include <tools/render/studio/tree_boxes.h>

#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/query/spawn.h>

#include <algorithm>
#include <cmath>

namespace hiprt::tools {
namespace {

/// The hit's unit normal on the ray's side. In double, because the squares of small triangles' normals vanish in float.
Vec3 facing_normal(const Ray& ray, const Hit& hit) {
  const Vec3d normal(hit.normal);
  const double length = glm::length(normal);
  if (!(length > 0.0 && std::isfinite(length))) return -ray.direction;
  return Vec3(normal / (glm::dot(normal, Vec3d(ray.direction)) > 0.0 ? -length : length));
}

bool has_centre_pass(const RenderOptions& options) { return options.samples == 1 || options.layers; }
bool is_centre_pass(const RenderOptions& options, unsigned pass) { return pass == 0 && has_centre_pass(options); }
std::uint32_t sample_of(const RenderOptions& options, unsigned pass) {
  return has_centre_pass(options) ? pass - 1 : pass;
}

/// A colour for a number: hues in steps of the golden ratio, which keeps those of near numbers apart.
Vec3 color_of(std::size_t number) {
  constexpr double kGoldenStep = 0.61803398874989485;
  const double turns = static_cast<double>(number) * kGoldenStep;
  const auto hue = static_cast<float>(turns - std::floor(turns));
  const auto channel = [&](float shift) { return 0.62f + 0.33f * std::cos(2.0f * kPi * (hue + shift)); };
  return linear_from_srgb(Vec3(channel(0.0f), channel(1.0f / 3.0f), channel(2.0f / 3.0f)));
}

}  // namespace

void store_centre_hit(const Ray& ray, const Hit& hit, std::uint32_t instance, Pixel& pixel) {
  pixel.normal = facing_normal(ray, hit);
  pixel.position = ray.origin + ray.direction * hit.t;
  pixel.depth = hit.t;
  pixel.geometry = hit.geometry;
  pixel.primitive = hit.primitive;
  pixel.instance = instance;
}

void clear_centre_hit(Pixel& pixel) {
  constexpr Pixel kMiss{};
  pixel.normal = kMiss.normal;
  pixel.position = kMiss.position;
  pixel.depth = kMiss.depth;
  pixel.geometry = kMiss.geometry;
  pixel.primitive = kMiss.primitive;
  pixel.instance = kMiss.instance;
}

TileRenderer::TileRenderer(const RenderJob& job, const Tile& tile, const TilePixels& pixels)
    : job_(job), tile_(tile), width_(tile.right - tile.left), pixels_(pixels) {
  const std::size_t count = std::size_t{width_} * (tile.bottom - tile.top);
  rays_.resize(count);
  hits_.resize(count);
  costs_.resize(count);
  if (job.options.layers) paths_.resize(count * job.scene.levels);
  sky_light_.resize(count);
}

unsigned TileRenderer::passes(const RenderOptions& options) {
  return (has_centre_pass(options) ? 1u : 0u) + (options.samples > 1 ? options.samples : 0u);
}

void TileRenderer::make_rays(unsigned pass) {
  const RenderOptions& options = job_.options;
  const bool centre = is_centre_pass(options, pass);
  counting_ = options.mode == RenderMode::kHeatmap || (centre && options.layers);
  centre ? make_centre_rays() : make_sample_rays(sample_of(options, pass));
  counts_.primary += rays_.size();
}

TileRays TileRenderer::primary() {
  if (!counting_) return {Query::kClosest, rays_, hits_, {}, {}};
  return {Query::kClosest, rays_, hits_, costs_, paths_};
}

void TileRenderer::shade(unsigned pass) {
  const RenderOptions& options = job_.options;
  refused_ = refused_ || hits_.front().failed();
  shadow_rays_.clear();
  shadows_.clear();
  if (is_centre_pass(options, pass)) {
    if (options.layers) store_layers();
    if (options.samples == 1) shade_sample(0);
  } else if (!refused_) {
    shade_sample(sample_of(options, pass));
  }
  shadow_hits_.resize(shadow_rays_.size());
  counts_.shadow += shadow_rays_.size();
}

TileRays TileRenderer::shadows() { return {Query::kAny, shadow_rays_, shadow_hits_, {}, {}}; }

void TileRenderer::finish() {
  if (job_.options.mode == RenderMode::kAo) add_sky_light();
}

void TileRenderer::run(unsigned first, unsigned end) {
  const auto trace_on_cpu = [&](const TileRays& work) {
    if (!work.rays.empty()) trace(job_.scene, work.query, {}, work.rays, work.hits, work.costs, work.paths);
  };
  for (unsigned pass = first; pass < end && !refused_ && !interrupted(); ++pass) {
    make_rays(pass);
    trace_on_cpu(primary());
    shade(pass);
    trace_on_cpu(shadows());
    add_shadows();
  }
  if (end == passes(job_.options)) finish();
}

std::size_t TileRenderer::pixel_of(std::size_t ray) const {
  return (tile_.top - pixels_.top + ray / width_) * pixels_.width + tile_.left - pixels_.left + ray % width_;
}

void TileRenderer::make_centre_rays() {
  std::size_t next = 0;
  for (std::uint32_t y = tile_.top; y < tile_.bottom; ++y)
    for (std::uint32_t x = tile_.left; x < tile_.right; ++x) {
      rays_[next] = job_.camera.ray(x + 0.5, y + 0.5);
      rays_[next++].time = time_of(0.5f);
    }
}

float TileRenderer::time_of(float part) const {
  return (1.0f - part) * job_.options.shutter.open + part * job_.options.shutter.close;
}

void TileRenderer::make_sample_rays(std::uint32_t sample) {
  std::size_t next = 0;
  for (std::uint32_t y = tile_.top; y < tile_.bottom; ++y)
    for (std::uint32_t x = tile_.left; x < tile_.right; ++x) {
      const PixelSampler sampler(x, y, job_.options.seed);
      const auto [u, v] = sampler.point(sample, SampleUse::kPixel);
      rays_[next] = job_.camera.ray(x + static_cast<double>(u), y + static_cast<double>(v));
      rays_[next++].time = time_of(sampler.point(sample, SampleUse::kTime)[0]);
    }
}

void TileRenderer::store_layers() {
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    Pixel& pixel = pixels_.pixels[pixel_of(i)];
    const RayCost& cost = costs_[i];
    pixel.box_tests = cost.box_tests;
    pixel.leaf_tests = cost.leaf_tests;
    pixel.triangle_tests = cost.triangle_tests;
    pixel.instance_tests = cost.instance_tests;
    pixel.steps = cost.box_tests + cost.leaf_tests + cost.instance_tests;
    if (cost.leaf_tests != 0)
      pixel.leaf_fill = static_cast<float>(cost.triangle_tests) / (2.0f * static_cast<float>(cost.leaf_tests));
    const Hit& hit = hits_[i];
    if (!hit.found()) continue;
    store_centre_hit(rays_[i], hit, paths_.empty() ? kInvalidId : paths_[i * job_.scene.levels], pixel);
    if (job_.options.boxes != nullptr)
      pixel.primitive = static_cast<std::uint32_t>(TreeBoxes::box_of_triangle(hit.primitive));
  }
}

void TileRenderer::shade_sample(std::uint32_t sample) {
  switch (job_.options.mode) {
    case RenderMode::kAo:
      return shade_ao(sample);
    case RenderMode::kPrimary:
      return shade_primary();
    case RenderMode::kNormals:
      return shade_normals();
    case RenderMode::kHeatmap:
      return shade_heatmap();
    case RenderMode::kBoxes:
      return shade_boxes();
  }
}

Vec3 TileRenderer::backdrop_of(std::size_t ray) const {
  const std::size_t row = tile_.top + ray / width_;
  return Studio::backdrop(1.0f - (static_cast<float>(row) + 0.5f) / static_cast<float>(job_.options.height));
}

void TileRenderer::shade_ao(std::uint32_t sample) {
  const float weight = 1.0f / static_cast<float>(job_.options.samples);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (!hits_[i].found()) {
      pixels_.pixels[pixel_of(i)].color += backdrop_of(i) * weight;
      continue;
    }
    const PixelSampler sampler(tile_.left + static_cast<std::uint32_t>(i) % width_,
                               tile_.top + static_cast<std::uint32_t>(i) / width_, job_.options.seed);
    const auto [u, v] = sampler.point(sample, SampleUse::kDirection);
    const Vec3 normal = facing_normal(rays_[i], hits_[i]);
    Ray shadow;
    shadow.direction = Frame(normal).to_world(cosine_direction(u, v));
    shadow.origin = spawn_origin(rays_[i], hits_[i], shadow.direction);
    shadow.tmax = job_.options.ao_distance;
    shadow.time = rays_[i].time;
    shadow_rays_.push_back(shadow);
    shadows_.push_back({i, job_.studio.sky(shadow.direction)});
    sky_light_[i].open += job_.studio.open_sky(normal) * weight;
  }
}

void TileRenderer::add_shadows() {
  for (std::size_t i = 0; i < shadows_.size(); ++i) {
    SkyLight& light = sky_light_[shadows_[i].ray];
    light.sampled += shadows_[i].light;
    if (!shadow_hits_[i].found()) light.arrived += shadows_[i].light;
  }
}

void TileRenderer::add_sky_light() {
  for (std::size_t i = 0; i < sky_light_.size(); ++i) {
    const SkyLight& light = sky_light_[i];
    if (light.sampled.x > 0.0f)
      pixels_.pixels[pixel_of(i)].color += Studio::clay() * light.open * light.arrived / light.sampled;
  }
}

void TileRenderer::shade_primary() {
  const float weight = 1.0f / static_cast<float>(job_.options.samples);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const float cosine = hits_[i].found() ? -glm::dot(facing_normal(rays_[i], hits_[i]), rays_[i].direction) : 0.0f;
    const Vec3 color = hits_[i].found() ? Studio::clay() * std::max(0.0f, cosine) : backdrop_of(i);
    pixels_.pixels[pixel_of(i)].color += color * weight;
  }
}

void TileRenderer::shade_normals() {
  const float weight = 1.0f / static_cast<float>(job_.options.samples);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (!hits_[i].found()) continue;
    const Vec3 display = glm::clamp(facing_normal(rays_[i], hits_[i]) * 0.5f + 0.5f, 0.0f, 1.0f);
    pixels_.pixels[pixel_of(i)].color += linear_from_srgb(display) * weight;
  }
}

/// Half a line's width, or less, from an edge of the side that was hit, as the picture shows it.
bool TileRenderer::is_on_edge(const Hit& hit) const {
  constexpr double kHalfWidth = 0.8;
  const TreeBoxes& boxes = *job_.options.boxes;
  const auto corner = [&](unsigned k) {
    const build::Position& p = boxes.corners[boxes.triangles[hit.primitive][k]];
    return Vec3d(p[0], p[1], p[2]);
  };
  const Vec3d first = corner(0), along_u = corner(1) - first, along_v = corner(2) - first;
  const auto position = [&](double u, double v) {
    return job_.camera.project(Vec3(first + along_u * u + along_v * v));
  };
  const auto u = static_cast<double>(hit.u), v = static_cast<double>(hit.v);
  const auto here = position(u, v);
  for (const auto& edge : {position(0.0, v), position(u, 0.0)})
    if (edge.in_front && std::hypot(edge.x - here.x, edge.y - here.y) <= kHalfWidth) return true;
  return false;
}

void TileRenderer::shade_boxes() {
  constexpr float kAmbient = 0.35f, kEdgeInk = 0.02f;
  const float weight = 1.0f / static_cast<float>(job_.options.samples);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    Vec3 color = backdrop_of(i);
    if (hits_[i].found()) {
      const float cosine = std::max(0.0f, -glm::dot(facing_normal(rays_[i], hits_[i]), rays_[i].direction));
      color = is_on_edge(hits_[i])
                  ? Vec3(kEdgeInk)
                  : color_of(TreeBoxes::box_of_triangle(hits_[i].primitive)) * (kAmbient + (1.0f - kAmbient) * cosine);
    }
    pixels_.pixels[pixel_of(i)].color += color * weight;
  }
}

void TileRenderer::shade_heatmap() {
  const float weight = 1.0f / static_cast<float>(job_.options.samples);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const RayCost& cost = costs_[i];
    pixels_.cost[pixel_of(i)] += static_cast<float>(cost.box_tests + cost.leaf_tests + cost.instance_tests) * weight;
  }
}

}  // namespace hiprt::tools
