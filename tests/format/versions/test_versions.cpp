// Files that the libraries of all versions wrote: valid, unchanged, and traced as their input says.

#include "golden_input.h"

#include <hiprt_build/file.h>
#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <tests/catch.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>

using namespace hiprt;
using namespace hiprt::golden;

namespace {

const std::filesystem::path kFolder = HIPRT_VERSIONS_FOLDER;

/// A line of files.txt.
struct Golden {
  unsigned minor;
  std::string name;  ///< Without ".bvh".
  std::uint64_t checksum;

  std::string path() const { return "1." + std::to_string(minor) + "/" + name + ".bvh"; }
  build::Buffer read() const {
    auto buffer = build::map_file(kFolder / path());
    REQUIRE(buffer);
    return std::move(*buffer);
  }
};

std::vector<Golden> listed() {
  std::ifstream file(kFolder / "files.txt");
  std::vector<Golden> result;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name, checksum;
    unsigned minor = 0;
    words >> minor >> name >> checksum;
    result.push_back({minor, name, std::stoull(checksum, nullptr, 16)});
  }
  REQUIRE_FALSE(result.empty());
  return result;
}

/// Calls check(golden, its view) for the files of all versions.
template <class Check> void for_each_file(const Check& check) {
  for (const Golden& golden : listed()) {
    INFO(golden.path());
    const build::Buffer buffer = golden.read();
    const auto view = open_buffer(buffer.bytes());
    REQUIRE(view);
    check(golden, *view);
  }
}

FeatureMask bits(std::initializer_list<Feature> features) {
  FeatureMask mask = 0;
  for (const Feature feature : features) mask |= feature_bit(feature);
  return mask;
}

using enum Feature;

/// What a file of this name holds, in every version that has it.
struct Content {
  NodeLayout layout;
  FeatureMask features;
  std::size_t geometries, primitives, dropped;
};
const std::map<std::string, Content> kContents{
    {"float", {NodeLayout::kFloat, bits({kTriangles, kMasks}), 2, 14, 1}},
    {"planes", {NodeLayout::kPlanes, bits({kTriangles, kMasks}), 2, 14, 1}},
    {"half", {NodeLayout::kHalf, bits({kTriangles, kMasks}), 2, 14, 1}},
    {"quantized", {NodeLayout::kQuantized, bits({kTriangles, kMasks}), 2, 14, 1}},
    {"split", {NodeLayout::kPlanes, bits({kTriangles, kSplitReferences}), 1, kSlivers, 0}},
    {"empty", {NodeLayout::kFloat, 0, 0, 0, 0}},
    {"gaps", {NodeLayout::kPlanes, bits({kTriangles}), 1, 2 * kField, 0}},
    {"customs", {NodeLayout::kPlanes, bits({kTriangles, kCustom}), 2, 18, 2}},
    {"customs_half", {NodeLayout::kHalf, bits({kTriangles, kCustom}), 2, 18, 2}},
    {"instances", {NodeLayout::kPlanes, bits({kTriangles, kMasks, kInstances}), 1, 3, 0}},
    {"instances_half", {NodeLayout::kHalf, bits({kTriangles, kMasks, kInstances}), 1, 3, 0}},
    {"nested", {NodeLayout::kQuantized, bits({kTriangles, kInstances}), 1, 2, 0}},
    {"motion", {NodeLayout::kFloat, bits({kTriangles, kInstances, kMotion}), 1, 4, 0}},
    {"shapes", {NodeLayout::kPlanes, bits({kCustom}), 2, 5, 0}},
    {"shape_instances", {NodeLayout::kPlanes, bits({kCustom, kMasks, kInstances}), 1, 3, 0}},
    {"types", {NodeLayout::kQuantized, bits({kTriangles, kCustom}), 2, 18, 2}},
    {"moving_shapes", {NodeLayout::kHalf, bits({kCustom}), 1, 2, 0}},
    {"moving_shape_instances", {NodeLayout::kHalf, bits({kCustom, kMasks, kInstances}), 1, 3, 0}},
    {"widened", {NodeLayout::kFloat, bits({kTriangles, kMasks, kWidenedBoxes}), 2, 14, 1}}};

/// The version that first had a file of this name.
unsigned first_minor(const std::string& name) {
  if (name == "float" || name == "planes" || name == "split" || name == "empty") return 0;
  if (name == "half" || name == "quantized" || name.starts_with("customs")) return 1;
  if (name == "gaps") return 8;
  if (name.starts_with("moving")) return 7;
  return name == "widened" ? 6 : name == "types" ? 5 : name.starts_with("shape") ? 3 : 2;
}

/// Custom primitives: the shapes of the file, or else the plane z = 0.5, in the middle of all boxes().
struct GoldenPrimitives {
  static constexpr unsigned kCount = kMaxGeometryType + 1;
  SceneShapes shapes;
  bool in_file;

  template <class Report>
  bool intersect(unsigned type, const Ray& ray, float tmin, float tmax, const PrimitiveId& id, Report&& report) const {
    if (in_file) return shapes.intersect(type, ray, tmin, tmax, id, report);
    return report(CustomHit{(0.5f - ray.origin.z) / ray.direction.z, 0, 0, Vec3(0, 0, 1), 0});
  }
  FilterResult filter(unsigned, const Ray&, const Hit&) const { return FilterResult::kAccept; }
};

/// The first hit. @p scene has up to two levels and may move.
PathHit<2> trace(const BufferView& file, const Ray& ray) {
  const SceneView scene = make_scene_view(file);
  return dispatch_layout(file.layout(), [&](auto layout) {
    using P = Moving<Instanced<WithLayout<decltype(layout)>, 2>>;
    typename P::Stack::Memory memory;
    ClosestHit<P, NoFilter, GoldenPrimitives> query(scene, ray, memory, {}, {SceneShapes(scene), scene.shapes != 0});
    return query.next_hit();
  });
}

/// A point of a primitive, and the instances that lead there.
struct Aim {
  std::array<double, 3> point;
  std::uint32_t geometry, primitive;
  std::vector<std::uint32_t> path{};
  float time = 0;
  std::uint32_t mask = 1;
};

constexpr float kAbove = 0.125f;

/// A ray that starts above the point and runs down.
PathHit<2> trace(const BufferView& file, const Aim& aim) {
  Ray ray;
  ray.origin = {static_cast<float>(aim.point[0]), static_cast<float>(aim.point[1]),
                static_cast<float>(aim.point[2]) + kAbove};
  ray.direction = {0, 0, -1};
  ray.time = aim.time;
  ray.mask = aim.mask;
  return trace(file, ray);
}

void check_hit(const BufferView& file, const Aim& aim) {
  CAPTURE(aim.geometry, aim.primitive, aim.time, aim.path);
  const PathHit<2> hit = trace(file, aim);
  REQUIRE_FALSE(hit.failed());
  REQUIRE(hit.found());
  CHECK(hit.t == Approx(kAbove).margin(1e-4));
  CHECK(hit.geometry == aim.geometry);
  CHECK(hit.primitive == aim.primitive);
  for (std::size_t level = 0; level < aim.path.size(); ++level) CHECK(hit.path.instance[level] == aim.path[level]);
}

/// The middle of each triangle of tiles().
std::vector<Aim> tile_aims() {
  std::vector<Aim> aims;
  for (std::uint32_t i = 0; i < kTiles; ++i) {
    const auto [x, y, z] = tile(i);
    aims.push_back({{x + 0.25, y + 0.25, z}, 0, 2 * i});
    aims.push_back({{x + 0.75, y + 0.75, z}, 0, 2 * i + 1});
  }
  return aims;
}

std::vector<Aim> box_aims() {
  std::vector<Aim> aims;
  for (std::uint32_t i = 0; i < kBoxes; ++i)
    if (i != kInvertedBox) aims.push_back({{3 * i + 0.5, 20.5, 0.5}, 1, i});
  return aims;
}

std::vector<Aim> shape_aims() {
  return {
      {{0, 30, 0.5}, 0, 0}, {{3, 30, 0.5}, 0, 1}, {{6, 30, 0.5}, 0, 2}, {{1, 35, 0.25}, 1, 0}, {{3, 35, 0.25}, 1, 1}};
}

std::vector<Aim> moving_shape_aims() {
  std::vector<Aim> aims;
  for (const float time : {-1.0f, -0.5f, 0.0f, 0.5f, 1.0f}) {
    const double x = 8 + 8 * time, z = time > 0 ? 4 * time : 0.0;
    aims.push_back({{x + 0.75, 50.25, z}, 0, 0, {}, time});
    aims.push_back({{x + 0.25, 50.75, z}, 0, 1, {}, time});
  }
  return aims;
}

/// The instances of write_files.cpp: moved, turned and doubled, mirrored.
std::vector<Aim> in_three(const std::vector<Aim>& of_object) {
  std::vector<Aim> aims;
  for (const Aim& aim : of_object) {
    const auto [x, y, z] = aim.point;
    aims.push_back({{x, y, z}, aim.geometry, aim.primitive, {0}, aim.time});
    aims.push_back({{30 - 2 * y, kRow + 2 * x, 2 * z}, aim.geometry, aim.primitive, {1}, aim.time});
    aims.push_back({{-20 - x, 2 * kRow + y, z}, aim.geometry, aim.primitive, {2}, aim.time, 2});
  }
  return aims;
}

/// A point of moving instance @p i at a time from 0 to 1.
std::array<double, 3> moved(unsigned i, const std::array<double, 3>& p, double time) {
  // Nlerp: the angle whose half has this tangent, from quaternions that are 45 degrees apart.
  const double sine = time * kSine45, cosine = 1 - time + time * kSine45;
  const double row = kRow * static_cast<double>(i);
  const double angle = i == 0 ? time * std::numbers::pi / 2 : i == 1 ? 2 * std::atan2(sine, cosine) : 0.0;
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * p[0] - s * p[1] + (i < 3 ? kMove * time : 0), s * p[0] + c * p[1] + row, p[2]};
}

std::vector<Aim> motion_aims() {
  std::vector<Aim> aims;
  for (const Aim& aim : tile_aims())
    for (std::uint32_t i = 0; i < 4; ++i)
      for (const float time : {0.0f, 0.25f, 0.5f, 1.0f})
        aims.push_back({moved(i, aim.point, time), 0, aim.primitive, {i}, time});
  return aims;
}

std::vector<Aim> nested_aims() {
  std::vector<Aim> aims;
  for (const Aim& aim : tile_aims())
    for (std::uint32_t outer = 0; outer < 2; ++outer)
      for (std::uint32_t inner = 0; inner < 2; ++inner)
        aims.push_back({{aim.point[0] + 20 * outer, aim.point[1] + (inner == 0 ? 0 : kRow), aim.point[2]},
                        0,
                        aim.primitive,
                        {outer, inner}});
  return aims;
}

std::vector<Aim> sliver_aims() {
  std::vector<Aim> aims;
  for (std::uint32_t i = 0; i < kSlivers; ++i) aims.push_back({{11, i + 32.0 / 3, 0.25 * i}, 0, i});
  return aims;
}

std::vector<Aim> field_aims() {
  std::vector<Aim> aims;
  for (std::uint32_t i = 0; i < kField; ++i) {
    const double x = 2.0 * i, z = 0.25 * (i % 5);
    aims.push_back({{x + 0.25, 0.25, z}, 0, 2 * i});
    aims.push_back({{x + 0.75, 0.75, z}, 0, 2 * i + 1});
  }
  return aims;
}

std::vector<Aim> aims_of(const std::string& name) {
  if (name == "empty") return {};
  if (name == "split") return sliver_aims();
  if (name == "gaps") return field_aims();
  if (name == "instances" || name == "instances_half") return in_three(tile_aims());
  if (name == "shape_instances") return in_three(shape_aims());
  if (name == "shapes") return shape_aims();
  if (name == "moving_shapes") return moving_shape_aims();
  if (name == "moving_shape_instances") return in_three(moving_shape_aims());
  if (name == "nested") return nested_aims();
  if (name == "motion") return motion_aims();
  std::vector<Aim> aims = tile_aims();
  const bool customs = name == "types" || name.starts_with("customs");
  for (const Aim& aim : customs ? box_aims() : std::vector<Aim>{{{6.25, 0.25, 0}, 1, 0, {}, 0, 2}}) aims.push_back(aim);
  return aims;
}

}  // namespace

TEST_CASE("files of every version are there, as they were written") {
  std::set<std::string> files, there;
  std::map<unsigned, std::set<std::string>> names;
  for (const Golden& golden : listed()) {
    INFO(golden.path());
    files.insert(golden.path());
    names[golden.minor].insert(golden.name);
    const build::Buffer buffer = golden.read();
    // validate() compares the checksum in the header with the bytes.
    CHECK(reinterpret_cast<const FileHeader*>(buffer.bytes().data())->checksum == golden.checksum);
  }
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kFolder))
    if (entry.path().extension() == ".bvh" && entry.path().parent_path().filename() != "refused")
      there.insert(std::filesystem::relative(entry.path(), kFolder).string());
  CHECK(files == there);
  // Every version has files. README.md says how to make them.
  REQUIRE(names.size() == kVersionMinor + 1u);
  for (const auto& [name, content] : kContents)
    for (unsigned minor = 0; minor <= kVersionMinor; ++minor) {
      INFO(name << " in version 1." << minor);
      CHECK(names[minor].contains(name) == (minor >= first_minor(name)));
    }
}

TEST_CASE("files of every version are valid and hold their input") {
  for_each_file([](const Golden& golden, const BufferView& view) {
    const auto valid = validate(view.bytes);
    INFO((valid ? "" : to_string(valid.error())));
    REQUIRE(valid);
    const Content& content = kContents.at(golden.name);
    FeatureMask features = content.features;
    if (golden.name == "motion" && golden.minor >= 4) features |= feature_bit(Feature::kMovingBoxes);
    // In 1.0 only Embree splits, and it splits none of these.
    if (golden.name == "split" && golden.minor == 0) features &= ~feature_bit(Feature::kSplitReferences);
    const std::size_t hidden = golden.name == "motion" && golden.minor >= 5 ? 1 : 0;
    CHECK(view.header->version_major == 1);
    CHECK(view.header->version_minor == golden.minor);
    CHECK(view.layout() == content.layout);
    CHECK(view.header->features == features);
    CHECK(view.geometries.size() == content.geometries);
    CHECK(view.primitive_map.size() == content.primitives + hidden);
    CHECK(valid->dropped == content.dropped);
    CHECK((view.header->box_margin > 0.0f) == (golden.name == "widened"));
    CHECK(view.node_places().has_gaps() == (golden.name == "gaps"));
    CHECK(view.provenance.find("write_files") != std::string_view::npos);
    if (golden.name.starts_with("customs")) CHECK(geometry_type(view.geometries[1].flags) == kBoxType);
    if (golden.name == "types")
      for (const GeometryRecord& geometry : view.geometries) CHECK(geometry_type(geometry.flags) == kLargeType);
    for (std::uint32_t i = 0; i < view.instances.size() && golden.name != "nested"; ++i)
      CHECK(view.instances[i].id == kFirstId + i);
  });
}

TEST_CASE("rays hit in files of every version what they are aimed at") {
  std::size_t rays = 0;
  for_each_file([&](const Golden& golden, const BufferView& view) {
    for (const Aim& aim : aims_of(golden.name)) {
      check_hit(view, aim);
      ++rays;
    }
    Aim beside{{-15, -15, 0}, 0, 0};
    CHECK(std::isinf(trace(view, beside).t));
  });
  CHECK(rays > 1000);
}

TEST_CASE("masks and hidden instances count in files of every version") {
  for_each_file([&](const Golden& golden, const BufferView& view) {
    for (Aim aim : aims_of(golden.name)) {
      if (aim.mask != 2) continue;
      aim.mask = 1;
      CHECK(std::isinf(trace(view, aim).t));
    }
    if (golden.name != "motion" || golden.minor < 5) return;
    const Aim shrinking{{0.25, 4 * kRow + 0.25, 0}, 0, 0, {4}};
    check_hit(view, shrinking);
    Aim hidden = shrinking;
    hidden.time = 1;
    CHECK(std::isinf(trace(view, hidden).t));
  });
}

TEST_CASE("files of versions that were still being developed are refused, not traced wrongly") {
  // No release wrote such files: README.md.
  const auto fault_of = [](const char* name) {
    const auto buffer = build::map_file(kFolder / "refused" / name);
    REQUIRE(buffer);
    const auto valid = validate(buffer->bytes());
    REQUIRE_FALSE(valid);
    return valid.error().error;
  };
  CHECK(fault_of("motion.bvh") == FormatError::kBoxNotContained);
  CHECK(fault_of("instances.bvh") == FormatError::kBadReservedField);
}
