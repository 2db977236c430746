#pragma once
/// Builds a BVH file in memory from meshes.
///
///     std::vector<hiprt::build::TriangleMesh> meshes = ...;
///     auto bvh = hiprt::build::build(meshes, {.builder = hiprt::build::Builder::kHq});
///     if (!bvh) std::cerr << bvh.error().message;
///     const hiprt::Hit hit = hiprt::closest_hit(bvh->scene(), ray);
///     hiprt::build::write_file("scene.bvh", bvh->buffer.bytes());

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/host/host_part.h>
#include <hiprt_build/input.h>
#include <hiprt_device/format/node.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hiprt::build {

enum class Builder {
  kSah,           ///< Binned surface area heuristic (Wald 2007).
  kLbvh,          ///< Hierarchy of 63-bit Morton codes (Karras 2012, Apetrei 2014): the fastest build.
  kLbvh30,        ///< The same with 30-bit codes: too coarse for small detail in a large scene.
  kPloc,          ///< Locally-ordered clustering in rounds (Meister and Bittner 2018).
  kHploc,         ///< Clustering on the way up the Morton hierarchy (Benthin et al. 2024).
  kSbvh,          ///< kSah with spatial splits (Stich et al. 2009).
  kHq,            ///< The fastest rays: kSbvh, then reinsertion (Meister and Bittner 2018).
  kEmbreeLow,     ///< rtcBuildBVH, RTC_BUILD_QUALITY_LOW (Morton order).
  kEmbreeMedium,  ///< rtcBuildBVH, RTC_BUILD_QUALITY_MEDIUM (binned SAH).
  kEmbreeHigh,    ///< rtcBuildBVH, RTC_BUILD_QUALITY_HIGH (binned SAH with spatial splits).
  kImported,      ///< The caller's tree: import_tree() (exchange.h) only.
};

/// @return the name used on command lines and in provenance: "sah", "lbvh", "lbvh30", "ploc", "hploc", "sbvh", "hq",
/// "embree-low", "embree-medium", "embree-high", "imported".
HIPRT_BUILD_API const char* name(Builder builder);

struct Progress {
  const char* step;  ///< "pair", "split", "collapse", "encode", ...; a string literal.
  double fraction;   ///< Of the whole build, 0 to 1, never decreasing.
};
/// Called about every 20 ms, from one thread at a time. Return false to cancel the build. Two calls are at most 50 ms
/// of work apart, except in Embree's builders, which call it when Embree does.
using ProgressCallback = std::function<bool(const Progress&)>;

/// Relative costs of the surface area heuristic.
struct SahCosts {
  float box_node = 1.0f;  ///< One four-box test.
  float leaf = 0.8f;      ///< One leaf (a pair of triangles).
  float custom = 1.5f;    ///< One custom leaf (two custom primitives): two box tests and a call or two.
};

/// A value of BuildOptions::split_budget: the builder chooses the budget from the scene. kSbvh and kHq take up to 8
/// where boxes are much larger than their triangles, for example around long diagonal ones (pipes, cables). Other
/// scenes, other builders and gpu::enqueue_build() get the default budget.
inline constexpr double kSplitsAsNeeded = 0.0;

struct BuildOptions {
  Builder builder = Builder::kSbvh;
  NodeLayout nodes = NodeLayout::kPlanes;
  /// Threads. 0 or more than the process may use: all of them (of the machine, or of tbb::global_control). The result
  /// does not depend on it.
  unsigned threads = 0;
  /// For kSbvh, kHq and kEmbreeHigh, 1 to 16: how many references spatial splits may make of one, on average. A larger
  /// budget gives faster rays, larger files and slower builds. Or kSplitsAsNeeded. Unset: 3 for kHq, 1.5 for the
  /// others.
  std::optional<double> split_budget{};
  /// 1 to 16: how many references the builder may make of one before it builds the tree, on average (Karras and Aila
  /// 2013). 1.2 to 1.5 with kHploc and rounds of reinsertion comes close to the quality of kSbvh in less time.
  double presplit_budget = 1.0;
  /// 0 to 1000: rounds of reinsertion. Each round moves nodes of an eighth of the tree. Unset: 32 for kHq, fewer where
  /// splits more than double the references; else 0.
  std::optional<unsigned> reinsertion_rounds{};
  /// For kPloc and kHploc, 1 to 128: how many neighbours along the Morton curve, to either side, a cluster is compared
  /// with. kHploc has 32 clusters at a time at most.
  unsigned ploc_radius = 8;
  unsigned max_leaf_triangles = 8;  ///< 1 to 64: triangles, or custom primitives, in the run of leaves below one child.
  bool pair_triangles = true;       ///< Two triangles with a common edge, or two close custom primitives, per leaf.
  /// Wider boxes, for AMD's ray instruction (HardwareBoxes). Layouts kFloat and kHalf only. Hits stay the same. A scene
  /// without box nodes, or beyond the range of floats, gets no wider boxes.
  bool widen_boxes = false;
  SahCosts costs{};
  ProgressCallback progress{};
  std::string_view tool{};  ///< For the provenance block, e.g. the command line.
};

/// The purpose of a build.
enum class Quality {
  kFast,      ///< The fastest build: kLbvh.
  kBalanced,  ///< The default: rays nearly as fast as with kHigh, by a build several times as fast. kSbvh.
  kHigh,      ///< The fastest rays: kHq.
};

/// @return the name used on command lines: "fast", "balanced", "high".
HIPRT_BUILD_API const char* name(Quality quality);

/// @return the defaults with the builder of a quality, and the options that go with it. build() refuses those of a
/// number that is no Quality.
///
///     auto options = hiprt::build::options_for(hiprt::build::Quality::kHigh);
///     options.progress = ...;
HIPRT_BUILD_API BuildOptions options_for(Quality quality);

struct BuildStatistics {
  /// The builder that made the tree. kSah if Embree failed because the tree was too deep. kEmbreeMedium instead of
  /// kEmbreeHigh if there are custom primitives, which cannot be split.
  Builder builder = Builder::kSah;
  std::uint64_t triangles = 0;           ///< Of the input.
  std::uint64_t customs = 0;             ///< Custom primitives of the input.
  std::uint64_t dropped_not_finite = 0;  ///< A corner, or a plane of a custom primitive's box, is NaN or infinite.
  std::uint64_t dropped_degenerate = 0;  ///< Two corners at the same position; a custom primitive's box is inverted.
  std::uint64_t pairs = 0;               ///< Leaves with two triangles, before spatial splits.
  std::uint64_t custom_pairs = 0;        ///< Leaves with two custom primitives.
  std::uint64_t nodes = 0, leaves = 0;   ///< Records in the file.
  std::uint64_t scratch_bytes_peak = 0;  ///< Peak memory of the builder's arrays, with the output.
  double pair_seconds = 0, tree_seconds = 0, collapse_seconds = 0, encode_seconds = 0, total_seconds = 0;
};

/// What a build returns: the file in memory, and figures of the build.
struct Bvh {
  Buffer buffer;
  BuildStatistics statistics;
  HostPart host{};

  /// The view that queries on the host take; <hiprt_device/hiprt_device.h> defines it. Valid while the Bvh lives. After
  /// a refit see HostPart::scene().
  HIPRT_BUILD_API SceneView scene() const;
};

/// Builds one BVH over all meshes; geometry i is meshes[i].
/// Errors of the input name the mesh, the triangle and the limit. Never throws and leaks nothing after an error.
HIPRT_BUILD_API Result<Bvh> build(std::span<const TriangleMesh> meshes, const BuildOptions& options = {});

/// Builds one BVH over meshes and custom primitives.
HIPRT_BUILD_API Result<Bvh> build(const SceneInput& scene, const BuildOptions& options = {});

/// Version of the compiled library, for example "0.2.0". The headers have hiprt_device/version.h.
HIPRT_BUILD_API const char* version();

/// @return the version of the Embree that the library was built with, for example "3.13.5"; "" if it was built without
/// Embree. Then builds with one of Embree's builders return kInvalidInput.
HIPRT_BUILD_API const char* embree_version();

}  // namespace hiprt::build
