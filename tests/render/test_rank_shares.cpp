/// GPUs, threads and messages of ranks.

#include "path_scenes.h"
#include "unit_fakes.h"

#include <tools/render/path/path_data_bytes.h>
#include <tools/render/units/rank_shares.h>
#include <tools/render/units/unit_messages.h>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

std::vector<std::uint32_t> range(std::uint32_t first, std::uint32_t end) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = first; i < end; ++i) numbers.push_back(i);
  return numbers;
}

}  // namespace

TEST_CASE("ranks of a host divide its processors") {
  const auto threads = [](const std::vector<RankMeans>& ranks) {
    std::vector<unsigned> result;
    for (const RankShare& share : share_hosts(ranks)) result.push_back(share.threads);
    return result;
  };
  using Threads = std::vector<unsigned>;
  const RankMeans all{"a", {}, range(0, 8)}, other{"b", {}, range(0, 4)};
  CHECK(threads({all}) == Threads{8});
  CHECK(threads({all, all, all, other}) == Threads{2, 2, 2, 4});
  CHECK(threads({all, all, all, all, all, all, all, all}) == Threads(8, 1));
  CHECK(threads(std::vector<RankMeans>(20, all)) == Threads(20, 1));
  // Bound by mpirun: to cores of their own, or two ranks to each half.
  CHECK(threads({{"a", {}, {0}}, {"a", {}, {1}}}) == Threads{1, 1});
  const RankMeans low{"a", {}, range(0, 6)}, high{"a", {}, range(6, 12)};
  CHECK(threads({low, low, low, high, high}) == Threads{2, 2, 2, 3, 3});
  CHECK_FALSE(own_processors().empty());
}

TEST_CASE("ranks of a host take its GPUs, one each") {
  const auto gpus = [](const std::vector<RankMeans>& ranks) {
    std::vector<int> result;
    for (const RankShare& share : share_hosts(ranks)) result.push_back(share.gpu.value_or(-1));
    return result;
  };
  using Gpus = std::vector<int>;
  const RankMeans two{"a", {"0:1:0", "0:2:0"}, {0}}, none{"a", {}, {0}}, elsewhere{"b", {"0:1:0"}, {0}};
  CHECK(gpus({two, two, two}) == Gpus{0, 1, -1});
  CHECK(gpus({none, two, elsewhere, two, elsewhere}) == Gpus{-1, 0, 0, 1, -1});
  // Slurm shows each rank its own GPU, with the number 0.
  CHECK(gpus({{"a", {"0:1:0"}, {0}}, {"a", {"0:2:0"}, {0}}}) == Gpus{0, 0});
}

TEST_CASE("means of a rank, units and results come back from messages; damaged ones are refused") {
  const RankMeans means{"node7", {"0:1:0", "0:2:0"}, range(3, 9)};
  const auto bytes = encode(means);
  const auto found = decode_means(bytes);
  REQUIRE(found);
  CHECK(found->host == means.host);
  CHECK(found->gpus == means.gpus);
  CHECK(found->processors == means.processors);
  for (std::size_t size = 0; size < bytes.size(); ++size) CHECK_FALSE(decode_means(std::span(bytes).first(size)));

  HashWork work(9, 1);
  for (const std::uint32_t first : {0u, 4u}) {
    UnitJob job{{5, 6, 3, 2, first, 2}, std::vector<std::byte>(6 * sizeof(std::uint64_t), std::byte{first != 0})};
    const auto message = encode(job);
    const auto back = decode_job(message, work.pixel_bytes());
    REQUIRE(back.has_value());
    CHECK(back->unit == job.unit);
    CHECK(back->state == job.state);
    for (std::size_t size = 0; size < message.size(); ++size)
      REQUIRE_FALSE(decode_job(std::span(message).first(size), work.pixel_bytes()).has_value());
    UnitResult result{job, {}, 0.25, {}};
    result.rays.secondary = 77;
    const auto answer = encode(result);
    const auto told = decode_result(answer, work.pixel_bytes());
    REQUIRE(told.has_value());
    CHECK(told->job.unit == job.unit);
    CHECK(told->job.state == job.state);
    CHECK(told->rays.secondary == 77);
    CHECK(told->seconds == 0.25);
    CHECK_FALSE(told->error.has_value());
    for (std::size_t size = 0; size < answer.size(); ++size)
      REQUIRE_FALSE(decode_result(std::span(answer).first(size), work.pixel_bytes()).has_value());
  }
  UnitResult failed{{{0, 0, 1, 1, 0, 1}, {}}, {}, 0.0, build::Error{build::ErrorCode::kGpu, "no GPU"}};
  const auto told = decode_result(encode(failed), work.pixel_bytes());
  REQUIRE((told && told->error));
  CHECK(told->error->code == build::ErrorCode::kGpu);
  CHECK(told->error->message == "no GPU");
}

TEST_CASE("the arrays of a path tracer come back from bytes, and equal scenes have equal checksums") {
  const auto make = [](float sky) {
    const PathTestScene scene = flat_scene({floor_square(4.0f), floor_square(1.0f)}, {{}, {}});
    return data_of(scene, [=](const Vec3&) { return Vec3(sky); });
  };
  const PathData data = make(1.0f);
  const auto bytes = encode(data);
  const auto back = decode_path_data(bytes);
  REQUIRE(back);
  CHECK(encode(*back) == bytes);
  CHECK(digest_of(*back) == digest_of(data));
  CHECK(digest_of(make(1.0f)) == digest_of(data));
  CHECK_FALSE(digest_of(make(0.5f)) == digest_of(data));
  CHECK_FALSE(decode_path_data(std::span(bytes).first(bytes.size() - 1)));
  CHECK_FALSE(decode_path_data({}));
}
