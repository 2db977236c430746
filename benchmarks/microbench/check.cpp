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

std::uint64_t bits_of(const Answer& answer, Query query) {
  if (query == Query::kAny) return answer.id != kInvalidId ? 1 : 0;
  return std::uint64_t{std::bit_cast<std::uint32_t>(answer.t)} << 32 | answer.id;
}

/// Of those what does not depend on distances.
std::uint64_t primitives_of(const Answer& answer, Query query) {
  if (query == Query::kClosest) return answer.id;
  if (query == Query::kAny) return bits_of(answer, query);
  return std::uint64_t{std::bit_cast<std::uint32_t>(answer.t)} << 32 | (answer.id & kPrimitiveBits);
}

}  // namespace

std::uint64_t checksum(std::span<const Answer> answers, Query query) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < answers.size(); ++i)
    sum += mix(mix(bits_of(answers[i], query)) + i * 0x9e3779b97f4a7c15u);
  return sum;
}

std::uint64_t count_hits(std::span<const Answer> answers, Query query) {
  std::uint64_t hits = 0;
  for (const Answer& answer : answers) {
    if (query != Query::kAll)
      hits += answer.id != kInvalidId ? 1 : 0;
    else if (answer.t > 0)  // Neither failed nor kPoison.
      hits += static_cast<std::uint64_t>(answer.t);
  }
  return hits;
}

HostAnswers::HostAnswers(const Tree& tree, std::span<const Ray> rays, Query query)
    : query_(query), step_(std::max<std::size_t>(1, rays.size() / kSamples)) {
  std::vector<Ray> sample;
  for (std::size_t i = 0; i < rays.size(); i += step_) sample.push_back(rays[i]);
  const SceneView scene = make_scene_view(tree.view);
  const Box* boxes = tree.boxes.empty() ? nullptr : tree.boxes.data();
  answers_.resize(sample.size());
  std::vector<Hit> hits(sample.size());
  run_on_cpu({&scene, query, false, scene.levels, boxes, sample.data(), hits.data(), answers_.data(), sample.size()});
  if (query != Query::kAll) std::transform(hits.begin(), hits.end(), answers_.begin(), make_answer);
}

HostAnswers::Comparison HostAnswers::compare(std::span<const Answer> answers) const {
  Comparison result;
  for (std::size_t i = 0; i < answers_.size(); ++i) {
    const Answer& answer = answers[i * step_];
    if (failed(answer)) continue;
    ++result.checked;
    if (bits_of(answer, query_) != bits_of(answers_[i], query_)) ++result.wrong;
    if (primitives_of(answer, query_) != primitives_of(answers_[i], query_)) ++result.other_primitives;
  }
  return result;
}

}  // namespace hiprt::bench
