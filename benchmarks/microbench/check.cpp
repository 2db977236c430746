#include "check.h"

#include "cpu_kernels.h"

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

std::uint64_t bits_of(const Answer& answer, bool any_hit) {
  if (any_hit) return answer.id != kInvalidId ? 1 : 0;
  return std::uint64_t{std::bit_cast<std::uint32_t>(answer.t)} << 32 | answer.id;
}

}  // namespace

std::uint64_t checksum(std::span<const Answer> answers, bool any_hit) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < answers.size(); ++i)
    sum += mix(mix(bits_of(answers[i], any_hit)) + i * 0x9e3779b97f4a7c15u);
  return sum;
}

HostAnswers::HostAnswers(const Tree& tree, std::span<const Ray> rays, bool any_hit)
    : any_hit_(any_hit), step_(std::max<std::size_t>(1, rays.size() / kSamples)) {
  std::vector<Ray> sample;
  for (std::size_t i = 0; i < rays.size(); i += step_) sample.push_back(rays[i]);
  std::vector<Hit> hits(sample.size());
  const SceneView scene = make_scene_view(tree.view);
  run_on_cpu({&scene, any_hit, false, tree.boxes.empty() ? nullptr : tree.boxes.data(), sample.data(), hits.data(),
              sample.size()});
  for (const Hit& hit : hits) answers_.push_back(make_answer(hit));
}

HostAnswers::Comparison HostAnswers::compare(std::span<const Answer> answers) const {
  Comparison result;
  for (std::size_t i = 0; i < answers_.size(); ++i) {
    const Answer& answer = answers[i * step_];
    if (failed(answer)) continue;
    ++result.checked;
    if (bits_of(answer, any_hit_) != bits_of(answers_[i], any_hit_)) ++result.wrong;
  }
  return result;
}

}  // namespace hiprt::bench
