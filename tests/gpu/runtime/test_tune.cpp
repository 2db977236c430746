// The choice of the fastest kernel.

#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/gpu/tune.h>
#include <tests/gpu/kernels.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

using namespace hiprt;
using namespace hiprt::checks;
using gpu::ErrorCode;
using gpu::Tuner;

namespace {

/// Candidates that start so many kernels each.
class Candidates {
 public:
  explicit Candidates(std::vector<unsigned> counts) : counts_(std::move(counts)), launches_(counts_.size()) {}

  unsigned size() const { return static_cast<unsigned>(counts_.size()); }
  const std::vector<unsigned>& launches() const { return launches_; }
  hipStream_t stream() const { return stream_; }

  gpu::Result<void> operator()(unsigned candidate) {
    ++launches_.at(candidate);
    if (counts_[candidate] == 0) return gpu::fail(ErrorCode::kGpu, "this candidate fails");
    gpu::Result<void> done{};
    for (unsigned i = 0; i < counts_[candidate] && done; ++i)
      done = gpu::launch(write_indices, kWords, stream_, {.block = 64}, words_.data(), 0u, kWords, words_.data());
    return done;
  }

 private:
  static constexpr unsigned kWords = 64;

  std::vector<unsigned> counts_, launches_;
  Stream stream_;
  gpu::DeviceAllocator allocator_;
  gpu::DeviceArray<unsigned> words_ = must(gpu::DeviceArray<unsigned>::make(kWords, stream_, allocator_));
};

std::vector<unsigned> all(unsigned candidates, unsigned times) { return std::vector<unsigned>(candidates, times); }

}  // namespace

TEST_CASE("a tuner finds the candidate with the least work, and remembers it for each key") {
  constexpr unsigned kLaunches = Tuner::kRounds + 1;
  Candidates candidates({100, 1, 100});
  Tuner tuner;
  CHECK(must(tuner.choose("rays", candidates.size(), candidates.stream(), candidates)) == 1);
  CHECK(candidates.launches() == all(3, kLaunches));
  CHECK(must(tuner.choose("rays", candidates.size(), candidates.stream(), candidates)) == 1);
  CHECK(candidates.launches() == all(3, kLaunches));
  CHECK(must(tuner.choose("others", candidates.size(), candidates.stream(), candidates)) == 1);
  CHECK(candidates.launches() == all(3, 2 * kLaunches));
  // Another number of candidates is another choice.
  CHECK(must(tuner.choose("rays", 2, candidates.stream(), candidates)) == 1);
  CHECK(candidates.launches() == std::vector<unsigned>{3 * kLaunches, 3 * kLaunches, 2 * kLaunches});
  tuner.clear();
  CHECK(must(tuner.choose("rays", candidates.size(), candidates.stream(), candidates)) == 1);
  CHECK(candidates.launches() == std::vector<unsigned>{4 * kLaunches, 4 * kLaunches, 3 * kLaunches});
}

TEST_CASE("a tuner measures nothing where there is nothing to choose") {
  Candidates candidates({1});
  Tuner tuner;
  CHECK(must(tuner.choose("rays", 1, candidates.stream(), candidates)) == 0);
  const auto none = tuner.choose("rays", 0, candidates.stream(), candidates);
  REQUIRE_FALSE(none.has_value());
  CHECK(none.error().code == ErrorCode::kInvalidInput);
  CHECK(none.error().message == "Tuner::choose(\"rays\"): no candidates");
  CHECK(candidates.launches() == all(1, 0));
}

TEST_CASE("a tuner passes on the error of a launch and remembers nothing") {
  Candidates candidates({1, 0});
  Tuner tuner;
  for (unsigned call = 1; call <= 2; ++call) {
    const auto failed = tuner.choose("rays", candidates.size(), candidates.stream(), candidates);
    REQUIRE_FALSE(failed.has_value());
    CHECK(failed.error().message == "this candidate fails");
    CHECK(candidates.launches() == all(2, call));
  }
}
