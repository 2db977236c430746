/// Checkpoints of pictures: what was kept comes back, and everything else is refused.

#include "unit_fakes.h"

#include <tests/amount.h>
#include <tests/tools/temp_folder.h>
#include <tools/render/units/picture_run.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;
using Catch::Contains;

namespace {

constexpr std::uint32_t kSteps = 9;
constexpr PictureGrid kGrid{50, 40, 16};
const PictureKey kKey{{"scene", "abc"}, {"spp", "9"}};

/// Some tiles whole, some begun, some not.
PictureState some_state(std::uint64_t seed) {
  HashWork work(kSteps, 1);
  oracle::Random random(seed);
  PictureState state(kGrid, work.pixel_bytes());
  for (std::uint32_t tile = 0; tile < kGrid.tiles(); ++tile) {
    const std::uint32_t steps = random.below(kSteps + 1);
    if (steps == 0) continue;
    const PictureUnit unit = kGrid.unit(tile, 1, 0, steps);
    std::vector<std::byte> part = state.cut(unit);
    REQUIRE(work.run(unit, part).has_value());
    state.paste(unit, part);
    state.advance(unit);
  }
  state.rays.primary = std::uint64_t{1} << 40;
  state.seconds = 2.5;
  return state;
}

std::string refusal(std::span<const std::byte> bytes, const PictureKey& key = kKey) {
  const auto state = decode_checkpoint(bytes, key, kGrid, kSteps, sizeof(std::uint64_t));
  return state ? "accepted" : state.error().message;
}

}  // namespace

TEST_CASE("a checkpoint comes back as it was, and the picture goes on from it with the same pixels") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    const PictureState kept = some_state(seed);
    const auto bytes = encode_checkpoint(kKey, kept);
    // The tile size of the run that goes on may be another.
    auto state = decode_checkpoint(bytes, kKey, {50, 40, 8}, kSteps, kept.pixel_bytes);
    REQUIRE(state.has_value());
    CHECK(state->grid == kGrid);
    CHECK(state->done == kept.done);
    CHECK(state->pixels == kept.pixels);
    CHECK(state->rays.primary == kept.rays.primary);
    CHECK(state->seconds == kept.seconds);
    HashWork work(kSteps, 2);
    REQUIRE(compute(work, *state, nullptr, nullptr, {}).has_value());
    CHECK(state->pixels == work.whole(50, 40));
  }
}

TEST_CASE("a checkpoint of another picture is refused with what differs") {
  const auto bytes = encode_checkpoint(kKey, some_state(1));
  CHECK_THAT(refusal(bytes, {{"scene", "abc"}, {"spp", "10"}}), Contains("spp is 9 there and 10 here"));
  CHECK_THAT(refusal(bytes, {{"scene", "abd"}, {"spp", "9"}}), Contains("scene is abc there and abd here"));
  CHECK_THAT(refusal(bytes, {{"scene", "abc"}}), Contains("spp is only there"));
  CHECK_THAT(refusal(bytes, {{"scene", "abc"}, {"spp", "9"}, {"sky", "1"}}), Contains("sky is only here"));
}

TEST_CASE("a truncated or changed checkpoint is refused") {
  auto bytes = encode_checkpoint(kKey, some_state(2));
  CHECK(refusal(bytes) == "accepted");
  for (std::size_t size = 0; size < bytes.size(); size += size < 600 ? 1 : 97)
    REQUIRE_THAT(refusal(std::span(bytes).first(size)), Contains("checkpoint"));
  oracle::Random random(3);
  for (unsigned i = 0; i < checks::trials(1000); ++i) {
    const auto at = random.below(static_cast<std::uint32_t>(bytes.size()));
    const auto bit = std::byte{1} << random.below(8);
    bytes[at] ^= bit;
    CAPTURE(at);
    REQUIRE_THAT(refusal(bytes), Contains("checkpoint"));
    bytes[at] ^= bit;
  }
}

TEST_CASE("a checkpoint's file: none is no error, and a picture that is whole has none") {
  const TempFolder folder;
  const std::string path = folder / "c";
  Checkpoint checkpoint(path, kKey, 0.0);
  const auto none = checkpoint.load(kGrid, kSteps, sizeof(std::uint64_t));
  REQUIRE(none.has_value());
  CHECK_FALSE(none->has_value());
  const PictureState state = some_state(4);
  REQUIRE(checkpoint.write(state).has_value());
  CHECK(folder.names() == std::vector<std::string>{"c"});
  const auto kept = checkpoint.load(kGrid, kSteps, sizeof(std::uint64_t));
  REQUIRE((kept && *kept));
  CHECK((*kept)->pixels == state.pixels);
  checkpoint.remove();
  CHECK(folder.names().empty());
  Checkpoint nowhere(folder / "none/c", kKey, 0.0);
  const auto failed = nowhere.write(state);
  REQUIRE_FALSE(failed.has_value());
  CHECK_THAT(failed.error().message, Contains("none/c"));
}

TEST_CASE("a checkpoint is written from time to time, and a fault of it is told once") {
  const TempFolder folder;
  HashWork work(200, 1);
  PictureState state({400, 300, 32}, work.pixel_bytes());
  Checkpoint checkpoint(folder / "c", kKey, 0.0);
  unsigned seen = 0, faults = 0;
  PictureHooks hooks;
  hooks.fraction = [&](double) { seen += std::filesystem::exists(checkpoint.path()) ? 1 : 0; };
  hooks.checkpoint_fault = [&](const build::Error&) { ++faults; };
  REQUIRE(compute(work, state, nullptr, &checkpoint, hooks).has_value());
  CHECK(seen > 0);
  CHECK(faults == 0);
  PictureState second({400, 300, 32}, work.pixel_bytes());
  Checkpoint nowhere(folder / "none/c", kKey, 0.0);
  REQUIRE(compute(work, second, nullptr, &nowhere, hooks).has_value());
  CHECK(faults == 1);
  CHECK(second.pixels == state.pixels);
}
