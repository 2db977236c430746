// Measures AMD's ray instruction against the assumption of docs/proofs/ray-instruction.md: how far its distances to the
// planes of boxes are from exact ones. Prints the largest error and a verdict. Exit status: 0 the assumption holds, 1
// it does not, 77 this GPU has no ray instruction.

#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::Box, hiprt::FloatBoxNode, hiprt::kBranching, hiprt::NodeRef, hiprt::Ray;

namespace {

/// What the proof allows: an error of 2^-24 / |d| * (kOfReach |p - o| + kOfMagnitude (|p| + |o|)).
constexpr double kUnit = 0x1p-24, kOfReach = 7, kOfMagnitude = 6;

/// A node whose four children the ray just meets, just misses, or that are absent.
struct Trial {
  FloatBoxNode node;
  Ray ray;
};

/// The result of the instruction, and the reciprocals that it was given.
struct Answer {
  std::uint32_t child[kBranching];
  float rcp[3];
};

#if HIPRT_HAS_RAY_INSTRUCTION
/// @param grows whether the exit distances grow as the library lets them.
__device__ hiprt::Words intersect(const Trial& trial, const hiprt::RaySlabs<hiprt::ArrayLanes>& slabs, bool grows) {
  using namespace hiprt::ray_instruction_detail;
  constexpr std::uint32_t kGrowthBits = 255u << 23;
  Descriptor descriptor(nullptr, 0);
  if (!grows) descriptor.word[1] &= ~kGrowthBits;
  const std::uint64_t pointer =
      (reinterpret_cast<std::uintptr_t>(&trial.node) >> 3) | static_cast<std::uint64_t>(hiprt::NodeType::kBox32);
  const hiprt::Vec3 &o = trial.ray.origin, &d = trial.ray.direction;
  const Word4 met = __builtin_amdgcn_image_bvh_intersect_ray_l(pointer, trial.ray.tmax, Float4{o.x, o.y, o.z, 0.0f},
                                                               Float4{d.x, d.y, d.z, 0.0f}, inverse_direction(slabs),
                                                               resource(descriptor));
  return {{met.x, met.y, met.z, met.w}};
}
#endif

__global__ void ask([[maybe_unused]] const Trial* trials, [[maybe_unused]] Answer* answers, unsigned count,
                    [[maybe_unused]] bool grows) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
#if HIPRT_HAS_RAY_INSTRUCTION
  const hiprt::RaySlabs<hiprt::ArrayLanes> slabs(trials[i].ray, 0.0f);
  const hiprt::Words met = intersect(trials[i], slabs, grows);
  for (unsigned k = 0; k < kBranching; ++k) answers[i].child[k] = met.word[k];
  for (unsigned k = 0; k < 3; ++k) answers[i].rcp[k] = slabs.rcp[k];
#endif
}

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed) {}

  Trial make() {
    Trial trial{};
    const float size = std::exp2(uniform(-40, 40)), offset = coin(3) ? size * std::exp2(uniform(0, 20)) : 0.0f;
    for (int k = 0; k < 3; ++k) {
      trial.ray.origin[k] = offset * uniform(-1, 1) + size * uniform(-1, 1);
      trial.ray.direction[k] = coin(8) ? 0.0f : uniform(-1, 1) * std::exp2(uniform(-8, 0));
    }
    if (trial.ray.direction == hiprt::Vec3(0.0f)) trial.ray.direction = hiprt::Vec3(0.0f, 1.0f, 0.0f);
    for (unsigned c = 0; c < kBranching; ++c) {
      trial.node.child[c] = coin(5) ? hiprt::kInvalidRef : 8 * (c + 1) + 5;
      trial.node.box[c] = trial.node.child[c] == hiprt::kInvalidRef ? absent() : touched(trial.ray, size);
    }
    trial.ray.tmax = coin(2) ? 0x1p100f : uniform(0, 4) * size;
    return trial;
  }

 private:
  static Box absent() {
    const float inf = std::numeric_limits<float>::infinity();
    return {{inf, inf, inf}, {-inf, -inf, -inf}};
  }
  /// A box with an edge or a corner within a few units in the last place of a point of the ray.
  Box touched(const Ray& ray, float size) {
    const float t = coin(6) ? 0.0f : size * std::exp2(uniform(-3, 3));
    Box box{};
    for (int k = 0; k < 3; ++k) {
      float at = ray.origin[k] + t * ray.direction[k];
      for (int steps = static_cast<int>(uniform(0, 6)); steps > 0; --steps)
        at = std::nextafter(at, coin(2) ? 1e38f : -1e38f);
      const float width = coin(8) ? 0.0f : size * uniform(0, 1);
      const bool below = coin(2);
      box.min[k] = below ? at - width : at;
      box.max[k] = below ? at : at + width;
    }
    return box;
  }
  float uniform(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
  bool coin(unsigned of) { return random_() % of == 0; }
  std::mt19937_64 random_;
};

/// The exit distance minus the entry distance if every plane has an error of @p times of what is allowed. A box that
/// has 0 or more must be met.
double gap(const Box& box, const Ray& ray, const float (&rcp)[3], double times) {
  double first = 0, last = ray.tmax;
  for (unsigned k = 0; k < 3; ++k) {
    const double r = rcp[k], from = ray.origin[static_cast<int>(k)];
    const auto distance = [&](double plane, double side) {
      const double allowed = kOfReach * std::abs(plane - from) + kOfMagnitude * (std::abs(plane) + std::abs(from));
      return (plane - from) * r + side * times * kUnit * std::abs(r) * allowed;
    };
    first = std::max(first, distance(r < 0 ? box.max[k] : box.min[k], 1));
    last = std::min(last, distance(r < 0 ? box.min[k] : box.max[k], -1));
  }
  return last - first;
}

struct Sum {
  unsigned long long boxes = 0, met = 0, near = 0, lost = 0, absent_met = 0, strangers = 0;
  double worst = 0;  ///< The largest error that was seen, in parts of what is allowed.

  bool holds() const { return lost == 0 && absent_met == 0 && strangers == 0 && met != 0 && met != boxes; }
};

/// The part of the allowed error at which a box that was missed would have to be missed.
double seen_error(const Box& box, const Ray& ray, const float (&rcp)[3]) {
  double low = 0, high = 4;
  for (int i = 0; i < 40; ++i) (gap(box, ray, rcp, 0.5 * (low + high)) >= 0 ? low : high) = 0.5 * (low + high);
  return low;
}

void judge(const Trial& trial, const Answer& answer, Sum& sum) {
  for (unsigned c = 0; c < kBranching; ++c) {
    const NodeRef ref = trial.node.child[c];
    const bool met = ref != hiprt::kInvalidRef && std::count(answer.child, answer.child + kBranching, ref) != 0;
    if (ref == hiprt::kInvalidRef) continue;
    ++sum.boxes;
    sum.met += met ? 1 : 0;
    const Box& box = trial.node.box[c];
    if (gap(box, trial.ray, answer.rcp, -1) >= 0 && gap(box, trial.ray, answer.rcp, 1) < 0) ++sum.near;
    if (met || gap(box, trial.ray, answer.rcp, 0) < 0) continue;
    const double seen = seen_error(box, trial.ray, answer.rcp);
    sum.worst = std::max(sum.worst, seen);
    sum.lost += seen >= 1 ? 1 : 0;
  }
  // Met children come first: the traversal stops at the first reference that is invalid.
  for (unsigned k = 1; k < kBranching; ++k)
    if (answer.child[k] != hiprt::kInvalidRef && answer.child[k - 1] == hiprt::kInvalidRef) ++sum.absent_met;
  for (const NodeRef child : answer.child)
    if (child != hiprt::kInvalidRef && std::count(trial.node.child, trial.node.child + kBranching, child) == 0)
      ++sum.strangers;
}

/// @param grows see intersect().
gpu::Result<Sum> measure(unsigned count, std::uint64_t seed, bool grows) {
  Maker maker(seed);
  std::vector<Trial> trials(count);
  for (Trial& trial : trials) trial = maker.make();
  std::vector<Answer> answers(count);
  gpu::DeviceAllocator allocator;
  const auto from = gpu::DeviceArray<Trial>::from(trials, nullptr, allocator);
  if (!from) return tl::unexpected(from.error());
  auto to = gpu::DeviceArray<Answer>::make(count, nullptr, allocator);
  if (!to) return tl::unexpected(to.error());
  hipLaunchKernelGGL(ask, dim3((count + 63) / 64), dim3(64), 0, nullptr, from->data(), to->data(), count, grows);
  if (auto copied = to->download(answers, nullptr); !copied) return tl::unexpected(copied.error());
  if (auto done = gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); !done)
    return tl::unexpected(done.error());
  Sum sum;
  for (unsigned i = 0; i < count; ++i) judge(trials[i], answers[i], sum);
  return sum;
}

void print(const Sum& sum, bool grows) {
  std::printf("%s: %llu boxes, %llu met, %llu within the allowed error of their boundary\n",
              grows ? "exit distances grow by 6 ulp (as in the library)" : "exit distances do not grow", sum.boxes,
              sum.met, sum.near);
  std::printf(
      "  largest error: %.3f of what the proof allows; boxes lost: %llu; invalid children first: %llu; unknown "
      "references: %llu\n",
      sum.worst, sum.lost, sum.absent_met, sum.strangers);
}

}  // namespace

int main(int argc, char** argv) {
  const unsigned count = argc > 1 ? static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10)) : 20000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 8;
  const auto device = gpu::current_device();
  if (!device || !(device->architecture.starts_with("gfx103") || device->architecture.starts_with("gfx11"))) {
    std::printf("SKIPPED: the GPU (%s) has no ray instruction\n", device ? device->architecture.c_str() : "none");
    return 77;
  }
  std::printf("%s, %u nodes, seed %llu\n", device->architecture.c_str(), count, static_cast<unsigned long long>(seed));
  bool holds = true;
  for (const bool grows : {false, true}) {
    const auto sum = measure(count, seed, grows);
    if (!sum) {
      std::printf("%s\n", sum.error().message.c_str());
      return 1;
    }
    print(*sum, grows);
    holds = holds && sum->holds();
  }
  std::printf("%s: the assumption of docs/proofs/ray-instruction.md %s\n", holds ? "PASS" : "FAIL",
              holds ? "holds" : "does not hold");
  return holds ? 0 : 1;
}
