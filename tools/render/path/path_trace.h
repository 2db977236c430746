#pragma once
/// Pictures by paths of light: bvhrender --integrator path.

#include <tools/render/path/path_batch.h>
#include <tools/render/path/path_data.h>

#include <functional>
#include <vector>

namespace hiprt::tools {

class GpuPathTracer;
struct Image;

struct PathOptions {
  std::uint32_t width = 1024, height = 768;
  std::uint32_t samples = 64;
  std::uint32_t seed = 0;
  std::uint32_t bounces = 8;
  Shutter shutter{};
  unsigned threads = 0;  ///< 0: all the machine has. The picture does not depend on it.
};

/// The picture after the samples so far.
struct PathPicture {
  std::vector<PathSum> sums;  ///< Per pixel, row by row from the top.
  PathRayCounts rays;
  std::uint32_t samples = 0;  ///< Of every pixel, at least.
  unsigned threads = 0;
  double seconds = 0;  ///< Ray generation, traversal and shading.
};

/// Callbacks, called by one thread at a time.
struct PathProgress {
  std::function<void(double)> fraction{};             ///< 0 to 1, often.
  std::function<void(const PathPicture&)> picture{};  ///< After 1, 2, 4, ... samples of all pixels.
};

PathSettings settings_of(const PathOptions& options, const Camera& camera);

/// @param scene the host's.
/// @param gpu traces and shades; nullptr: the CPU does. The pixels are the same.
/// @return also when interrupted() became true: what there is then (PathPicture::samples; some pixels may have more).
/// The errors of GpuPathTracer; kInvalidInput if rays failed.
build::Result<PathPicture> trace_paths(const SceneView& scene, const PathData& data, const Camera& camera,
                                       const PathOptions& options, const PathProgress& progress = {},
                                       GpuPathTracer* gpu = nullptr);

/// Writes the mean and the variance of the samples into the pixels.
void store(const PathPicture& picture, Image& image);

/// Writes the surfaces that the rays through the pixels' centres hit: albedo, normal, texture coordinates. Where
/// materials cut out parts of triangles, it writes all layers of the hits again except costs.
/// @return kCancelled when interrupted() became true.
build::Result<void> store_surfaces(const SceneView& scene, const PathData& data, const Camera& camera,
                                   const PathOptions& options, Image& image);

}  // namespace hiprt::tools
