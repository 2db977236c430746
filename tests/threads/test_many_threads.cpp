// 32 threads call the library at the same time, on the same scenes and on scenes of their own. THREADS.md says what a
// program may do at the same time; every row about the host is tried here. Each result is compared, bit by bit, with
// that of one thread.

#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/threads.h>
#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/merge_levels.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/shapes.h>
#include <hiprt_build/statistics.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <hiprt_device/query/closest_point.h>

#include <tests/amount.h>
#include <tests/catch.h>
#include <tests/oracle/mesh.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/tools/temp_folder.h>

#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <functional>
#include <thread>

using namespace hiprt;

namespace {

constexpr unsigned kThreads = 32, kMeshes = 4;
constexpr std::uint64_t kSeed = 34;

using Bytes = std::string;
using Tracer = Instanced<Policies, 2>;
using View = std::span<const std::byte>;

Bytes copy_of(View bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// Bits of hits, to compare.
template <class HitType> void add(Bytes& bits, const HitType& hit) {
  for (const std::uint32_t word : {std::bit_cast<std::uint32_t>(hit.t), hit.geometry, hit.primitive})
    bits.append(reinterpret_cast<const char*>(&word), sizeof(word));
}

std::vector<Ray> make_rays() {
  oracle::Random random(kSeed);
  std::vector<Ray> rays(200);
  for (Ray& ray : rays) {
    const oracle::Position from = random.in_cube(1.5), to = random.in_cube(0.5);
    ray.origin = {from[0], from[1], from[2]};
    ray.direction = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  }
  return rays;
}

/// One std::thread per index.
const ParallelLoop kLoop = [](std::size_t count, const std::function<void(std::size_t)>& body) {
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < count; ++i) threads.emplace_back([&, i] { body(i); });
  for (std::thread& thread : threads) thread.join();
};

/// What all threads read, and one file that all of them write.
struct Shared {
  std::vector<oracle::Mesh> meshes, moved;  ///< kMeshes of each.
  std::vector<Ray> rays = make_rays();
  build::Bvh bvh;    ///< Of mesh 0.
  build::Bvh scene;  ///< Groups of instances of bvh.
  Bytes written;     ///< Content of path.
  test::TempFolder folder;
  std::string path = (folder / "shared.bvh").string();

  Shared() {
    for (unsigned i = 0; i < kMeshes; ++i) {
      meshes.push_back(oracle::soup(150 + 50 * i, 0.2, kSeed + i));
      moved.push_back(oracle::placed(meshes.back(), 1.25, {0.125, 0, 0}));
    }
    auto built = build_mesh(0, {});
    REQUIRE(built);
    bvh = std::move(*built);
    written = copy_of(bvh.buffer.bytes());
    REQUIRE(build::write_file(path, bvh.buffer.bytes()));
    auto instances = build_scene(bvh.buffer.bytes());
    REQUIRE(instances);
    scene = std::move(*instances);
  }

  build::Result<build::Bvh> build_mesh(unsigned i, const build::BuildOptions& options) const {
    const build::TriangleMesh views[] = {meshes[i].view()};
    return build::build(views, options);
  }

  /// Calls use(InstancedScene): eight instances of a pair of instances of @p file.
  template <class Use> static auto with_groups(View file, const Use& use) {
    std::vector<build::Instance> pair(2), row(8);
    pair[1].to_scene.row[2][3] = 1;
    for (unsigned i = 0; i < 8; ++i) {
      row[i] = {.object = 1, .id = i};
      row[i].to_scene.row[0][3] = 0.25f * static_cast<float>(i);
    }
    const View files[] = {file};
    const std::span<const build::Instance> groups[] = {pair, row};
    return use(build::InstancedScene{files, groups});
  }
  static build::Result<build::Bvh> build_scene(View file) {
    return with_groups(file, [](const build::InstancedScene& groups) { return build::build_instances(groups); });
  }

  Bytes trace_flat(const SceneView& view, const ParallelLoop& loop = {}) const {
    std::vector<Hit> hits(rays.size());
    Bytes bits;
    if (!closest_hits(view, rays, hits, loop)) return "refused";
    for (const Hit& hit : hits) add(bits, hit);
    return bits;
  }
  Bytes trace_instances(const SceneView& view) const {
    Bytes bits;
    for (const Ray& ray : rays) add(bits, closest_hit<Tracer>(view, ray));
    return bits;
  }
};

/// Work for any thread, on @p shared and on mesh @p own. The result depends on both only.
struct Task {
  const char* name;
  Bytes (*run)(const Shared& shared, unsigned own);
};

Bytes built_with(const Shared& shared, unsigned own, build::Builder builder, NodeLayout layout, unsigned threads) {
  const auto bvh = shared.build_mesh(own, {.builder = builder, .nodes = layout, .threads = threads});
  return bvh ? copy_of(bvh->buffer.bytes()) : bvh.error().message;
}

Bytes refitted_in_place(const Shared& shared, unsigned own) {
  auto bvh = shared.build_mesh(own, {.builder = build::Builder::kHploc});
  if (!bvh) return bvh.error().message;
  const build::TriangleMesh moved[] = {shared.moved[own].view()};
  const auto refitted = build::refit(bvh->buffer.bytes(), {.meshes = moved});
  return refitted ? copy_of(bvh->buffer.bytes()) + shared.trace_flat(bvh->scene()) : refitted.error().message;
}

Bytes refitted_copy(const Shared& shared, unsigned) {
  const build::TriangleMesh moved[] = {shared.moved[0].view()};
  const auto refitted = build::refit_copy(shared.bvh.buffer.bytes(), {.meshes = moved});
  return refitted ? copy_of(refitted->buffer.bytes()) : refitted.error().message;
}

Bytes validated(const Shared& shared, unsigned own) {
  const auto file = validate(shared.bvh.buffer.bytes()), scene = validate(shared.scene.buffer.bytes(), kLoop);
  Bytes damaged = shared.written;
  damaged[damaged.size() - 1 - own] ^= 1;
  const auto refused = open_scene(std::as_bytes(std::span(damaged)), "damaged");
  return std::to_string(file && scene && !refused);
}

Bytes merged(const Shared& shared, unsigned) {
  return Shared::with_groups(shared.bvh.buffer.bytes(), [](const build::InstancedScene& groups) {
    const auto levels = build::merge_levels(groups);
    return levels ? std::to_string(levels->groups.back().size()) : levels.error().message;
  });
}

Bytes own_scene(const Shared& shared, unsigned own) {
  const auto bvh = shared.build_mesh(own, {.builder = build::Builder::kLbvh});
  if (!bvh) return bvh.error().message;
  const auto scene = Shared::build_scene(bvh->buffer.bytes());
  return scene ? copy_of(scene->buffer.bytes()) + shared.trace_instances(scene->scene()) : scene.error().message;
}

Bytes exchanged(const Shared& shared, unsigned) {
  const auto view = open_buffer(shared.bvh.buffer.bytes());
  const auto tree = build::export_tree(*view);
  if (!tree) return tree.error().message;
  const build::TriangleMesh meshes[] = {shared.meshes[0].view()};
  const auto bvh = build::import_tree({.meshes = meshes}, *tree);
  return bvh ? copy_of(bvh->buffer.bytes()) + std::to_string(build::measure_tree(*view).sah_cost) : bvh.error().message;
}

/// The file is there and whole while others replace it.
Bytes opened(const Shared& shared, unsigned) {
  const auto file = open_scene(shared.path);
  return file ? shared.trace_flat(file->scene()) : file.error().message;
}

Bytes written(const Shared& shared, unsigned own) {
  const std::filesystem::path folder = shared.folder / ("own-" + std::to_string(own));
  std::filesystem::create_directory(folder);
  const std::string mine = (folder / "own.bvh").string();
  for (const std::string& path : {shared.path, mine})
    if (const auto done = build::write_file(path, shared.bvh.buffer.bytes()); !done) return done.error().message;
  const auto mapped = build::map_file(mine);
  return mapped ? copy_of(mapped->bytes()) : mapped.error().message;
}

Bytes cancelled(const Shared& shared, unsigned own) {
  const auto no = [](const build::Progress&) { return false; };
  const auto bvh = shared.build_mesh(own, {.builder = build::Builder::kSbvh, .progress = no});
  return bvh ? "built" : bvh.error().message;
}

Bytes near_points(const Shared& shared, unsigned own) {
  Bytes bits;
  for (const Ray& ray : shared.rays) {
    const ClosestPoint found = closest_point(shared.bvh.scene(), ray.origin, 0.25f * static_cast<float>(1 + own));
    for (const std::uint32_t word :
         {std::bit_cast<std::uint32_t>(static_cast<float>(found.distance_squared)), found.geometry, found.primitive})
      bits.append(reinterpret_cast<const char*>(&word), sizeof(word));
  }
  return bits;
}

/// The mesh moves to where `moved` has it.
Bytes moving(const Shared& shared, unsigned own) {
  std::vector<ShapePoint> points;
  for (const auto* mesh : {&shared.meshes[own], &shared.moved[own]})
    for (const auto& p : mesh->positions)
      points.push_back({{p[0], p[1], p[2]}, mesh == &shared.meshes[own] ? 0.0f : 1.0f});
  std::vector<std::uint32_t> corners;
  for (const auto& t : shared.meshes[own].triangles) corners.insert(corners.end(), t.begin(), t.end());
  const build::Shapes shapes{ShapeKind::kMovingTriangles, points, corners, 2};
  const auto boxes = build::shape_boxes(shapes);
  if (!boxes) return boxes.error().message;
  const build::CustomGeometry geometry[] = {{.boxes = *boxes, .shapes = shapes}};
  const auto bvh = build::build(build::SceneInput{.customs = geometry});
  if (!bvh) return bvh.error().message;
  Bytes bits = copy_of(bvh->buffer.bytes());
  const SceneView view = bvh->scene();
  for (Ray ray : shared.rays) {
    ray.time = 0.5f;
    PrivateStack<>::Memory stack;
    add(bits, ClosestHit<Policies, NoFilter, SceneShapes>(view, ray, stack, {}, SceneShapes(view)).next_hit());
  }
  return bits;
}

using enum build::Builder;
constexpr std::array kTasks{
    Task{"build sah", [](const Shared& s, unsigned own) { return built_with(s, own, kSah, NodeLayout::kFloat, 0); }},
    Task{"build hploc", [](const Shared& s, unsigned own) { return built_with(s, own, kHploc, NodeLayout::kHalf, 0); }},
    Task{"build ploc", [](const Shared& s, unsigned own) { return built_with(s, own, kPloc, NodeLayout::kPlanes, 1); }},
    Task{"build hq", [](const Shared& s, unsigned own) { return built_with(s, own, kHq, NodeLayout::kQuantized, 2); }},
    Task{"cancel", cancelled},
    Task{"trace", [](const Shared& s, unsigned) { return s.trace_flat(s.bvh.scene()); }},
    Task{"trace with a loop", [](const Shared& s, unsigned) { return s.trace_flat(s.bvh.scene(), kLoop); }},
    Task{"trace instances", [](const Shared& s, unsigned) { return s.trace_instances(s.scene.scene()); }},
    Task{"closest points", near_points},
    Task{"triangles that move", moving},
    Task{"refit", refitted_in_place},
    Task{"refit a copy", refitted_copy},
    Task{"validate", validated},
    Task{"merge levels", merged},
    Task{"instances", own_scene},
    Task{"exchange", exchanged},
    Task{"open a file", opened},
    Task{"write files", written},
};

}  // namespace

TEST_CASE("32 threads get the results of one") {
  const Shared shared;
  // More than the machine may have, so that threads are interrupted at any point.
  const build::Threads::Limit workers(4);
  std::array<std::array<Bytes, kMeshes>, kTasks.size()> expected;
  for (std::size_t task = 0; task < kTasks.size(); ++task)
    for (unsigned own = 0; own < kMeshes; ++own) expected[task][own] = kTasks[task].run(shared, own);
  const Shared fresh;  // Nobody has asked for its scene(): threads do so at the same time.
  std::array<std::atomic<unsigned>, kTasks.size()> runs{}, wrong{};
  std::atomic<bool> go{false};
  std::vector<std::thread> threads;
  for (unsigned thread = 0; thread < kThreads; ++thread)
    threads.emplace_back([&, thread] {
      while (!go) std::this_thread::yield();
      // At first pairs of threads have the same task; then each task meets others.
      for (std::size_t round = 0; round < kTasks.size(); ++round) {
        const std::size_t step = thread % 2 == 0 ? round : kTasks.size() - round;
        const std::size_t task = (thread / 2 + step) % kTasks.size();
        const unsigned own = thread % kMeshes;
        ++runs[task];
        if (kTasks[task].run(fresh, own) != expected[task][own]) ++wrong[task];
      }
    });
  go = true;
  for (std::thread& thread : threads) thread.join();
  for (std::size_t task = 0; task < kTasks.size(); ++task) {
    INFO(kTasks[task].name);
    CHECK(runs[task] == kThreads);
    CHECK(wrong[task] == 0);
  }
  // Nothing was refused, and temporary files are gone.
  const auto result_of = [&](std::string_view name) {
    std::size_t task = 0;
    while (kTasks[task].name != name) ++task;
    return expected[task][0];
  };
  CHECK(result_of("cancel").find("cancelled") != Bytes::npos);
  CHECK(result_of("validate") == "1");
  CHECK(result_of("merge levels") == "16");
  CHECK(fresh.folder.names().size() == 1 + kMeshes);
}

TEST_CASE("32 threads trace one scene that moves on between frames") {
  Shared shared;
  const build::TriangleMesh still[] = {shared.meshes[0].view()}, moved[] = {shared.moved[0].view()};
  const Bytes before = shared.trace_flat(shared.bvh.scene());
  for (int frame = 0; frame < 4; ++frame) {
    // Nobody traces during the refit and the first scene() behind it.
    REQUIRE(build::refit(shared.bvh.buffer.bytes(), {.meshes = frame % 2 == 0 ? moved : still}));
    const SceneView view = shared.bvh.scene();
    const Bytes alone = shared.trace_flat(view);
    CHECK((alone == before) == (frame % 2 == 1));
    std::array<Bytes, kThreads> results;
    std::vector<std::thread> threads;
    for (Bytes& result : results) threads.emplace_back([&] { result = shared.trace_flat(view); });
    for (std::thread& thread : threads) thread.join();
    for (const Bytes& result : results) CHECK((result == alone));
  }
}
