// What builds leave: cancelled at random questions they give one error, keep no memory, and the next build makes the
// same bytes. Many builds take no more memory than the first ones.

#include <hiprt_build/gpu/build_steps.h>
#include <tests/amount.h>
#include <tests/gpu/builders/build_as_if_large.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using build::Builder;
using Catch::Matchers::StartsWith;

namespace {

using Bytes = std::vector<std::byte>;

const gpu::BuildOptions kConfigurations[] = {
    {.builder = Builder::kLbvh}, {.builder = Builder::kLbvh30, .reinsertion_rounds = 3},
    {.builder = Builder::kPloc}, {.builder = Builder::kHploc, .presplit_budget = 1.5, .reinsertion_rounds = 2},
    {.builder = Builder::kSah},  {.builder = Builder::kSbvh, .presplit_budget = 1.2, .reinsertion_rounds = 1},
    {.builder = Builder::kHq},
};

/// Answers questions with yes, and one of them with no.
class Asked {
 public:
  static constexpr unsigned kNever = ~0u;

  explicit Asked(unsigned no = kNever) : no_(no) {}
  build::ProgressCallback callback() {
    return [this](const build::Progress&) { return number_++ != no_; };
  }
  unsigned number() const { return number_; }

 private:
  unsigned number_ = 0, no_;
};

Bytes bytes_of(const gpu::DeviceBuffer& buffer) {
  Bytes bytes(buffer.size());
  must(buffer.download(bytes, nullptr));
  REQUIRE(hipStreamSynchronize(nullptr) == hipSuccess);
  return bytes;
}

gpu::Result<Bytes> build_whole(const Input& input, const gpu::BuildOptions& options, CountingAllocator& allocator) {
  const auto scene = gpu::build_scene(input.geometries, options, nullptr, allocator);
  if (!scene) return tl::unexpected(scene.error());
  return bytes_of(scene->buffer);
}

gpu::Result<Bytes> build_in_steps(const Input& input, const gpu::BuildOptions& options, CountingAllocator& allocator) {
  auto steps = must(gpu::BuildSteps::make(input.geometries, options));
  gpu::DeviceBuffer scene;
  while (!steps.done()) {
    auto output = must(gpu::DeviceBuffer::make(steps.sizes().output, nullptr, allocator));
    auto scratch = must(gpu::DeviceBuffer::make(steps.sizes().scratch, nullptr, allocator));
    if (auto started = steps.enqueue(output.data(), scratch.data(), nullptr); !started)
      return tl::unexpected(started.error());
    must(steps.wait());
    scene = std::move(output);
  }
  return bytes_of(scene);
}

/// Builds in memory that it keeps, with the bytes of earlier builds in it.
/// @tparam kLarge whether it asks between all rounds and levels, as builds of millions of triangles do.
template <bool kLarge> class BuildInPlace {
 public:
  BuildInPlace(const Input& input, const gpu::BuildOptions& options) : sizes_(must(sizes_of(input, options))) {
    output_ = must(gpu::DeviceBuffer::make(sizes_.output, nullptr, memory_));
    scratch_ = must(gpu::DeviceBuffer::make(sizes_.scratch, nullptr, memory_));
  }
  gpu::Result<Bytes> operator()(const Input& input, const gpu::BuildOptions& options, CountingAllocator& allocator) {
    const auto report = kLarge
                            ? enqueue_as_if_large(input.geometries, options, output_.data(), scratch_.data())
                            : gpu::enqueue_build(input.geometries, options, output_.data(), scratch_.data(), nullptr);
    if (!report) return tl::unexpected(report.error());
    return bytes_of(must(gpu::compact(*report, nullptr, allocator)).buffer);
  }

 private:
  static gpu::Result<gpu::BuildSizes> sizes_of(const Input& input, const gpu::BuildOptions& options) {
    return gpu::build_sizes(input.geometries, options);
  }

  CountingAllocator memory_;
  gpu::BuildSizes sizes_;
  gpu::DeviceBuffer output_, scratch_;
};

/// How often builds were cancelled, and how many questions they ask.
struct Cancelled {
  unsigned points = 0, questions = 0;
};

/// Cancels a build at random questions.
template <class Build>
void check_cancelled(const char* how, Input& input, Build&& build, gpu::BuildOptions options, Cancelled& sum) {
  CountingAllocator allocator;
  oracle::Random random(kSeed);
  Asked undisturbed;
  options.progress = undisturbed.callback();
  const Bytes expected = must(build(input, options, allocator));
  const unsigned questions = undisturbed.number(), points = trials(9);
  REQUIRE(questions > 3);
  for (unsigned i = 0; i < points; ++i) {
    const unsigned at = random.below(questions);
    INFO(how << ", seed " << kSeed << ": no to question " << at << " of " << questions);
    Asked asked(at);
    options.progress = asked.callback();
    const gpu::Error error = error_of(build(input, options, allocator));
    CHECK(error.code == build::ErrorCode::kCancelled);
    CHECK_THAT(error.message, StartsWith("the build was cancelled "));
    CHECK(asked.number() == at + 1);
    CHECK(allocator.balance() == 0);
    CHECK(allocator.bad_frees == 0);
    CHECK(hipGetLastError() == hipSuccess);
    if (i % 5 != 0 && i + 1 != points) continue;
    Asked again;
    options.progress = again.callback();
    REQUIRE(must(build(input, options, allocator)) == expected);
    CHECK(again.number() == questions);
  }
  options.progress = {};
  CHECK(must(build(input, options, allocator)) == expected);
  CHECK(allocator.balance() == 0);
  sum.points += points;
  sum.questions += questions;
}

}  // namespace

TEST_CASE("builds that are cancelled at random questions keep no memory, and the next one makes the same bytes") {
  Input input({oracle::soup(150, 0.3, kSeed), oracle::torus(8, 6, 0.3)});
  Cancelled whole, steps, in_place, large;
  for (const gpu::BuildOptions& options : kConfigurations) {
    INFO(build::name(options.builder));
    check_cancelled("build_scene", input, build_whole, options, whole);
    check_cancelled("BuildSteps", input, build_in_steps, options, steps);
    check_cancelled("enqueue_build", input, BuildInPlace<false>(input, options), options, in_place);
    check_cancelled("as if large", input, BuildInPlace<true>(input, options), options, large);
  }
  CHECK(large.questions > in_place.questions);
  std::printf("cancelled at random questions, seed %lu: build_scene %u times, BuildSteps %u, enqueue_build %u\n", kSeed,
              whole.points, steps.points, in_place.points);
  std::printf("asked between rounds and levels too: %u times, of %u questions instead of %u\n", large.points,
              large.questions, in_place.questions);
}

TEST_CASE("many builds take no more device memory than the first ones") {
  Input input({oracle::soup(20, 0.4, kSeed)});
  CountingAllocator allocator;
  std::size_t most = 0;
  unsigned calls = 0, cycles = 0;
  constexpr unsigned kRound = std::size(kConfigurations), kCycles = 1001 / kRound * kRound;
  for (; cycles < kCycles; ++cycles) {
    if (cycles == kRound) most = allocator.most, calls = allocator.calls;
    const auto scene = must(gpu::build_scene(input.geometries, kConfigurations[cycles % kRound], nullptr, allocator));
    REQUIRE(allocator.balance() == scene.buffer.size());
  }
  CHECK(allocator.balance() == 0);
  CHECK(allocator.bad_frees == 0);
  CHECK(allocator.most == most);
  CHECK(allocator.calls == calls * (kCycles / kRound));
  std::printf("%u builds: at most %zu bytes at once, as in the first %u\n", cycles, most, kRound);
}
