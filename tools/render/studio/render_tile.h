#pragma once
/// One tile of a picture, wavefront style: each step handles all rays of the tile before the next step starts.

#include <tools/render/studio/render.h>
#include <tools/render/studio/studio.h>
#include <tools/render/tracers/tracer.h>

#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::tools {

/// The data that all tiles of a picture share.
struct RenderJob {
  const SceneView& scene;
  const RenderOptions& options;
  CameraRays camera;
  Studio studio;
};

/// Side of a tile on the CPU, in pixels. Its rays and hits, or its paths, fit into a core's cache, and there are enough
/// tiles for many threads.
inline constexpr std::uint32_t kTileSize = 32;

/// A rectangle of pixels; right and bottom are exclusive.
struct Tile {
  std::uint32_t left, top, right, bottom;
};

/// A rectangle of pixels that holds a tile, row by row.
struct TilePixels {
  std::span<Pixel> pixels;
  std::span<float> cost;    ///< Tests of the pixels' primary rays. Empty unless RenderMode::kHeatmap.
  std::uint32_t left, top;  ///< The rectangle's first pixel in the picture.
  std::uint32_t width;      ///< Of the rectangle.
};

/// Sums over a pixel's samples. The light of the open sky is known exactly. It is multiplied by the fraction of the
/// sampled light that arrives. Surfaces without shadows thus have no noise (Heitz, Hill, McGuire, "Combining analytic
/// direct illumination and stochastic shadows", I3D 2018).
struct SkyLight {
  Vec3 open{0.0f};     ///< Light of the open sky, from the normals.
  Vec3 sampled{0.0f};  ///< Sent by the sky along the shadow rays.
  Vec3 arrived{0.0f};  ///< The part of it that was not shadowed.
};

/// Rays of a tile to trace, in the form of trace().
struct TileRays {
  Query query;
  std::span<const Ray> rays;
  std::span<Hit> hits;
  std::span<RayCost> costs;
  std::span<std::uint32_t> paths;  ///< Empty unless costs are requested.
};

/// Fills the layers of a pixel that belong to the ray through its centre, without costs.
/// @param hit found. @param instance the outermost of its path; kInvalidId: none.
void store_centre_hit(const Ray& ray, const Hit& hit, std::uint32_t instance, Pixel& pixel);
/// The same for a ray without a hit.
void clear_centre_hit(Pixel& pixel);

/// A pass is: make_rays(), trace primary(), shade(), trace shadows(), add_shadows(). finish() follows the last pass.
/// Tiles are independent: they may take the steps together or one tile after the other.
class TileRenderer {
 public:
  /// @param pixels hold the tile. They are written.
  TileRenderer(const RenderJob& job, const Tile& tile, const TilePixels& pixels);

  /// Number of passes: one for rays through the pixels' centres, if they are needed, and one per sample if there are
  /// several.
  static unsigned passes(const RenderOptions& options);

  void make_rays(unsigned pass);
  TileRays primary();
  void shade(unsigned pass);
  TileRays shadows();
  void add_shadows();
  void finish();

  /// Runs all steps of passes [first, end) on the CPU, and finish() after the last pass of the picture.
  void run(unsigned first, unsigned end);

  /// What the passes so far leave to later ones besides the pixels, per pixel of the tile, row by row.
  std::span<SkyLight> sky_light() { return sky_light_; }

  const RayCounts& counts() const { return counts_; }
  bool failed() const { return refused_; }

 private:
  struct Shadow {
    std::size_t ray;  ///< Index of the primary ray; equal in all samples of a pixel.
    Vec3 light;       ///< Arrives if the shadow ray has no hit.
  };

  void make_centre_rays();
  /// Time of a ray. @param part of the shutter's interval, 0 to 1.
  float time_of(float part) const;
  void make_sample_rays(std::uint32_t sample);
  void store_layers();
  void shade_sample(std::uint32_t sample);
  void shade_ao(std::uint32_t sample);
  void shade_primary();
  void shade_normals();
  void shade_heatmap();
  void shade_boxes();
  bool is_on_edge(const Hit& hit) const;
  void add_sky_light();
  std::size_t pixel_of(std::size_t ray) const;
  Vec3 backdrop_of(std::size_t ray) const;

  const RenderJob& job_;
  Tile tile_;
  std::uint32_t width_;
  TilePixels pixels_;
  std::vector<Ray> rays_, shadow_rays_;
  std::vector<Hit> hits_, shadow_hits_;
  std::vector<RayCost> costs_;
  std::vector<std::uint32_t> paths_;  ///< Empty if no layers are requested, or the scene has no instances.
  std::vector<Shadow> shadows_;
  std::vector<SkyLight> sky_light_;
  RayCounts counts_;
  bool counting_ = false;  ///< The current pass needs costs_ and paths_.
  bool refused_ = false;
};

}  // namespace hiprt::tools
