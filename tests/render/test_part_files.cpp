/// The files of scenes in parts: who gets what, and what is refused.

#include "part_scenes.h"

#include <tests/amount.h>
#include <tools/parts/split_scene.h>
#include <tools/render/parts/part_work.h>

#include <nlohmann/json.hpp>

#include <numeric>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;
using Catch::Contains;

namespace {

constexpr PartSceneOptions kOptions{};

std::string refused(const nlohmann::json& document) {
  const auto manifest = parse_part_manifest(document.dump(), "p.json");
  REQUIRE(!manifest.has_value());
  CHECK(manifest.error().code == build::ErrorCode::kInvalidInput);
  return manifest.error().message;
}

}  // namespace

TEST_CASE("split: every instance is in one part, and no part has much more memory than necessary") {
  oracle::Random random(5);
  for (unsigned trial = 0; trial < checks::trials(200); ++trial) {
    CAPTURE(trial);
    SplitInput input;
    input.instance_bytes = 10;
    const unsigned objects = 1 + random.below(20), count = 1 + random.below(300);
    for (unsigned i = 0; i < objects; ++i) {
      input.needs.push_back({i});
      if (i != 0 && random.coin()) input.needs.back().push_back(random.below(i));
      input.file_bytes.push_back(random.below(1000));
    }
    for (unsigned i = 0; i < count; ++i)
      input.instances.push_back({{random.uniform(0, 9), random.uniform(0, 1), 0.0}, random.below(objects)});
    const std::size_t parts = 1 + random.below(std::min(count, 9u));
    const auto split = split_scene(input, parts);
    REQUIRE(split.size() == parts);
    std::vector<std::uint32_t> all;
    for (const auto& part : split) {
      CHECK(!part.empty());
      CHECK(std::is_sorted(part.begin(), part.end()));
      all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end());
    REQUIRE(all.size() == count);
    for (std::uint32_t i = 0; i < count; ++i) CHECK(all[i] == i);
  }
}

TEST_CASE("split: instances without shared objects are divided evenly, and into compact parts") {
  SplitInput input;
  input.instance_bytes = 1;
  for (unsigned i = 0; i < 1024; ++i) {
    input.needs.push_back({i});
    input.file_bytes.push_back(99);
    input.instances.push_back({{static_cast<double>(i % 32), static_cast<double>(i >> 5), 0.0}, i});
  }
  for (const std::size_t parts : {2u, 4u, 16u}) {
    for (const auto& part : split_scene(input, parts)) {
      CHECK(bytes_of(input, part) * parts == 1024 * 100);
      double low[2] = {99, 99}, high[2] = {-1, -1};
      for (const std::uint32_t i : part)
        for (unsigned axis = 0; axis < 2; ++axis) {
          low[axis] = std::min(low[axis], input.instances[i].center[axis]);
          high[axis] = std::max(high[axis], input.instances[i].center[axis]);
        }
      // A rectangle of its instances, at most twice as long as wide.
      const double width = high[0] - low[0] + 1, height = high[1] - low[1] + 1;
      CHECK(width * height == static_cast<double>(part.size()));
      CHECK(std::max(width, height) <= 2 * std::min(width, height));
    }
  }
}

TEST_CASE("owners: neighbouring parts go together, and the largest share is as small as possible") {
  oracle::Random random(6);
  for (unsigned trial = 0; trial < 200; ++trial) {
    std::vector<ScenePart> parts(1 + random.below(7));
    for (ScenePart& part : parts) part.bvh.bytes = random.below(50);
    const unsigned processes = 1 + random.below(6);
    CAPTURE(trial, parts.size(), processes);
    const auto owner = owners_of(parts, processes);
    REQUIRE(owner.size() == parts.size());
    CHECK(std::is_sorted(owner.begin(), owner.end()));
    CHECK(owner.back() < processes);
    const auto largest = [&](const std::vector<unsigned>& of) {
      std::vector<std::uint64_t> sum(processes);
      for (std::size_t i = 0; i < parts.size(); ++i) sum[of[i]] += parts[i].bytes();
      return *std::max_element(sum.begin(), sum.end());
    };
    // All ways to cut the row of parts.
    std::uint64_t least = ~std::uint64_t{0};
    for (unsigned cuts = 0; cuts < 1u << (parts.size() - 1); ++cuts) {
      std::vector<unsigned> other{0};
      for (std::size_t i = 1; i < parts.size(); ++i) other.push_back(other.back() + (cuts >> (i - 1) & 1u));
      if (other.back() < processes) least = std::min(least, largest(other));
    }
    CHECK(largest(owner) == least);
  }
}

TEST_CASE("parts: bytes do not depend on the run, and all instances are there once") {
  const PartedScene first(4, kOptions, true, 3), second(4, kOptions, true, 3);
  std::string a = to_json(first.manifest()), b = to_json(second.manifest());
  CHECK(a == b);
  std::uint64_t instances = 0;
  for (const ScenePart& part : first.manifest().parts) instances += part.instances;
  REQUIRE(first.manifest().shared.has_value());
  CHECK(instances + first.manifest().shared->instances == first.manifest().instances);
  CHECK(first.folder().names().size() == 9);
}

TEST_CASE("parts: more parts than instances are refused") {
  PartDescription description = random_description(1, {.groups = 0, .instances = 2});
  BuiltScene built;
  const auto nothing = [](const char*, double) {};
  const auto files = build_objects(description.scene, {}, nothing, built);
  REQUIRE(files.has_value());
  const TempFolder folder;
  const auto parts = build_parts(description.scene, *files, nullptr, {1000, folder / "p.json"}, {}, nothing);
  REQUIRE(!parts.has_value());
  CHECK_THAT(parts.error().message, Contains("random: 1000 parts need as many instances"));
  CHECK(folder.names().empty());
}

TEST_CASE("manifests of parts: faults are told with their location") {
  const PartedScene scene(4, kOptions, true, 2);
  const auto good = nlohmann::json::parse(to_json(scene.manifest()));
  const auto with = [&](const std::string& pointer, const nlohmann::json& value) {
    nlohmann::json document = good;
    document[nlohmann::json::json_pointer(pointer)] = value;
    return refused(document);
  };
  const auto without = [&](const std::string& pointer, const char* key) {
    nlohmann::json document = good;
    document[nlohmann::json::json_pointer(pointer)].erase(key);
    return refused(document);
  };
  CHECK_THAT(with("/format", "hiprt scene"), Contains("p.json: format: 'hiprt scene'; expected 'hiprt parts'"));
  CHECK_THAT(with("/version", 2), Contains("version: 2; this program reads version 1"));
  CHECK_THAT(with("/levels", 0), Contains("levels: "));
  CHECK_THAT(with("/parts", nlohmann::json::array()), Contains("parts: 0 parts"));
  CHECK_THAT(with("/materials", 3), Contains("materials: "));
  CHECK_THAT(with("/parts/1/bvh/name", ""), Contains("parts[1].bvh.name: "));
  CHECK_THAT(with("/parts/1/bvh/bytes", -1), Contains("parts[1].bvh.bytes: it is no whole number"));
  CHECK_THAT(with("/parts/1/bvh/bytes", 1.5), Contains("it is no whole number"));
  CHECK_THAT(with("/parts/1/data/xxh3", "12"), Contains("parts[1].data.xxh3: '12' is no checksum"));
  CHECK_THAT(with("/parts/0/bounds/0", 1e39), Contains("parts[0].bounds: a number does not fit into a float"));
  CHECK_THAT(with("/parts/0/boxes/0/3", -1e30), Contains("parts[0].boxes[0]: a minimum is above its maximum"));
  CHECK_THAT(with("/parts/0/condition", -1), Contains("parts[0].condition: it is negative"));
  CHECK_THAT(with("/parts/0/reach", -1), Contains("parts[0].reach: it is negative"));
  CHECK_THAT(with("/parts/0/boxes", std::vector<nlohmann::json>(65, good["parts"][0]["bounds"])),
             Contains("parts[0].boxes: 65 boxes; the limit is 64"));
  for (const char* key : {"format", "version", "levels", "instances", "materials", "parts"})
    CHECK_THAT(without("", key), Contains(std::string("'") + key + "' is missing"));
  for (const char* key : {"bvh", "data", "instances", "bounds", "condition", "reach", "boxes"})
    CHECK_THAT(without("/parts/0", key), Contains("parts[0]: '" + std::string(key) + "' is missing"));
  CHECK_THAT(with("/shared/bvh", 3), Contains("shared.bvh: "));
  CHECK(!parse_part_manifest("[]", "p.json").has_value());
  CHECK(!parse_part_manifest("", "p.json").has_value());
}

TEST_CASE("data of parts: damaged bytes are refused, or decode to numbers that stay in their arrays") {
  const PartedScene scene(4, kOptions, true, 2);
  const ScenePart& part = scene.manifest().parts[0];
  const auto bvh = build::read_file(scene.manifest().path_of(part.bvh));
  const auto bytes = build::read_file(scene.manifest().path_of(part.data));
  REQUIRE((bvh.has_value() && bytes.has_value()));
  const BufferView view = *open_buffer(bvh->bytes());
  const auto good = decode_part_data(bytes->bytes(), view);
  REQUIRE(good.has_value());
  const std::vector<std::byte> whole(bytes->bytes().begin(), bytes->bytes().end());
  std::vector<std::byte> newer = whole;
  newer[8] = std::byte{9};
  CHECK(decode_part_data(newer, view).error().message == "its version is 9, this program reads version 2");
  // Every shorter file.
  for (std::size_t size = 0; size < whole.size(); size += 1 + size / 50)
    CHECK(!decode_part_data(std::span(whole).first(size), view).has_value());
  oracle::Random random(9);
  unsigned refusals = 0;
  for (unsigned i = 0; i < checks::trials(20000); ++i) {
    std::vector<std::byte> damaged = whole;
    for (unsigned k = 0; k <= random.below(3); ++k) {
      // The first bytes have the counts.
      const auto at = random.below(static_cast<std::uint32_t>(random.coin() ? damaged.size() : 200));
      damaged[at] = static_cast<std::byte>(random.bits());
    }
    const auto data = decode_part_data(damaged, view);
    if (!data) {
      ++refusals;
      CHECK(!data.error().message.empty());
      continue;
    }
    // Sanitizers see wrong reads.
    auto arrays = make_path_data(view, data->surfaces ? &*data->surfaces : nullptr, {}, {}, 0.5f);
    CHECK(arrays.has_value());
  }
  CHECK(refusals > 0);
  // That of another part.
  const auto other = build::read_file(scene.manifest().path_of(scene.manifest().parts[1].bvh));
  REQUIRE(other.has_value());
  CHECK(!decode_part_data(whole, *open_buffer(other->bytes())).has_value());
}

TEST_CASE("memory of rays: a little is divided, too little is refused with the least") {
  for (const unsigned ranks : {1u, 2u, 100u})
    for (const std::uint32_t levels : {1u, 32u}) {
      const auto refused = RayMemory::divide(100, ranks, 4, levels);
      REQUIRE(!refused.has_value());
      const std::string message = refused.error().message;
      CHECK_THAT(message, Contains("--ray-memory is too small for 4 threads and " + std::to_string(ranks) + " ranks"));
      const std::uint64_t least = std::stoull(message.substr(message.find("at least ") + 9));
      const auto divided = RayMemory::divide(least, ranks, 4, levels);
      REQUIRE(divided.has_value());
      CHECK(divided->paths >= 1);
      CHECK(divided->credit >= 1);
      CHECK(!RayMemory::divide(least - 2, ranks, 4, levels).has_value());
      const auto more = RayMemory::divide(1u << 30, ranks, 4, levels);
      REQUIRE(more.has_value());
      CHECK(more->credit >= divided->credit);
      CHECK(more->paths <= 65536);
    }
}
