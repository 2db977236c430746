#include "check.h"

#include "cpu_kernels.h"

#include <hiprt_build/format/view.h>
#include <hiprt_device/scene_view.h>

#include <algorithm>
#include <bit>

namespace hiprt::bench {
namespace {

constexpr std::size_t kSamples = 2000;

/// The finaliser of SplitMix64: every bit of the input changes half of the output.
std::uint64_t mix(std::uint64_t v) {
  v = (v ^ v >> 30) * 0xbf58476d1ce4e5b9u;
  v = (v ^ v >> 27) * 0x94d049bb133111ebu;
  return v ^ v >> 31;
}

std::uint64_t bits_of(const RayResult& result, Query query) {
  if (query == Query::kAny) return result.id != kInvalidId ? 1 : 0;
  return std::uint64_t{std::bit_cast<std::uint32_t>(result.t)} << 32 | result.id;
}

/// The part of bits_of() that does not depend on distances.
std::uint64_t primitives_of(const RayResult& result, Query query) {
  if (query == Query::kClosest) return result.id;
  if (query == Query::kAny) return bits_of(result, query);
  return std::uint64_t{std::bit_cast<std::uint32_t>(result.t)} << 32 | (result.id & kPrimitiveBits);
}

}  // namespace

std::uint64_t checksum(std::span<const RayResult> results, Query query) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < results.size(); ++i)
    sum += mix(mix(bits_of(results[i], query)) + i * 0x9e3779b97f4a7c15u);
  return sum;
}

std::uint64_t count_hits(std::span<const RayResult> results, Query query) {
  std::uint64_t hits = 0;
  for (const RayResult& result : results) {
    if (query != Query::kAll)
      hits += result.id != kInvalidId ? 1 : 0;
    else if (result.t > 0)  // Neither failed nor kPoison.
      hits += static_cast<std::uint64_t>(result.t);
  }
  return hits;
}

HostResults::HostResults(const Tree& tree, std::span<const Ray> rays, Query query)
    : query_(query), step_(std::max<std::size_t>(1, rays.size() / kSamples)) {
  std::vector<Ray> sample;
  for (std::size_t i = 0; i < rays.size(); i += step_) sample.push_back(rays[i]);
  const SceneView scene = make_scene_view(tree.view);
  const Box* boxes = tree.boxes.empty() ? nullptr : tree.boxes.data();
  results_.resize(sample.size());
  std::vector<Hit> hits(sample.size());
  run_on_cpu({&scene, query, false, scene.levels, boxes, sample.data(), hits.data(), results_.data(), sample.size()});
  if (query != Query::kAll) std::transform(hits.begin(), hits.end(), results_.begin(), make_result);
}

HostResults::Comparison HostResults::compare(std::span<const RayResult> results) const {
  Comparison comparison;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    const RayResult& result = results[i * step_];
    if (failed(result)) continue;
    ++comparison.checked;
    if (bits_of(result, query_) != bits_of(results_[i], query_)) ++comparison.wrong;
    if (primitives_of(result, query_) != primitives_of(results_[i], query_)) ++comparison.other_primitives;
  }
  return comparison;
}

}  // namespace hiprt::bench
