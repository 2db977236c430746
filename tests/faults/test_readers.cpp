// Allocations of importers, readers and renderers that fail: each gives one error or is survived, nothing leaks, and
// the next call works. Formats with JSON, and OpenEXR, are left out: see "Not ours" in RELIABILITY.md.

#include <hiprt_build/build.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/open_scene.h>
#include <tests/faults/every_allocation.h>
#include <tests/fuzz/make_reader_corpus.h>
#include <tests/fuzz/part_of_scene.h>
#include <tests/oracle/meshes.h>
#include <tests/render/path_scenes.h>
#include <tests/tools/temp_folder.h>
#include <tools/build/shape_geometries.h>
#include <tools/cli/cli.h>
#include <tools/render/path/path_trace.h>
#include <tools/render/scene/camera.h>
#include <tools/render/studio/render.h>
#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/query_file.h>
#include <tools/scene_io/query_npy.h>
#include <tools/scene_io/rays_file.h>
#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/scene/scene_file.h>
#include <tools/scene_io/shapes/shape_import.h>
#include <tools/scene_io/surface/picture.h>

#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <new>
#include <regex>
#include <set>
#include <string>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

using Path = std::filesystem::path;

/// The seeds of a reader, each as a file with an extension that tells its format.
std::vector<Path> seeds(const Path& corpus, const std::string& reader, const std::string& extension) {
  std::vector<Path> files;
  for (const auto& entry : std::filesystem::directory_iterator(corpus / reader)) {
    Path named = entry.path();
    named += extension;
    std::filesystem::copy_file(entry.path(), named);
    files.push_back(named);
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Of the seeds that the reader accepts.
template <class Read>
void check_reader(const Path& corpus, const std::string& reader, const std::string& extension, const Read& read) {
  const std::vector<Path> files = seeds(corpus, reader, extension);
  unsigned accepted = 0;
  for (const Path& file : files) {
    if (!read(file)) continue;
    ++accepted;
    check_every_allocation(reader + " " + file.filename().string(), kMost, [&] { return read(file); });
  }
  CAPTURE(reader);
  CHECK(accepted != 0);
}

std::vector<std::byte> bytes_of(const Path& file) {
  std::ifstream input(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(input)), std::istreambuf_iterator<char>());
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// What @p work prints to standard error, through C++ and C.
template <class Work> std::string printed_errors(const Work& work) {
  std::FILE* const file = std::tmpfile();
  const int old = ::dup(STDERR_FILENO);
  REQUIRE(file != nullptr);
  REQUIRE(::dup2(::fileno(file), STDERR_FILENO) >= 0);
  work();
  std::fflush(stderr);
  ::dup2(old, STDERR_FILENO);
  ::close(old);
  std::string text(1000, '\0');
  std::rewind(file);
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return text;
}

}  // namespace

TEST_CASE("allocations that fail: importers of meshes and shapes") {
  const test::TempFolder folder;
  fuzz::make_reader_corpus(folder / "");
  const auto mesh = [](const Path& file) { return tools::load_mesh(file); };
  check_reader(folder / "", "obj", ".obj", mesh);
  check_reader(folder / "", "ply", ".ply", mesh);
  check_reader(folder / "", "stl", ".stl", mesh);
  check_reader(folder / "", "mesh", ".mesh", mesh);
  check_reader(folder / "", "zst", ".mesh.zst", mesh);
  const auto shapes = [](const Path& file) { return tools::load_shapes(file); };
  check_reader(folder / "", "hair", ".hair", shapes);
  check_reader(folder / "", "xyzr", ".xyzr", shapes);
}

TEST_CASE("allocations that fail: readers of scenes, rays and pictures") {
  const test::TempFolder folder;
  fuzz::make_reader_corpus(folder / "");
  check_reader(folder / "", "scene", ".scene", [](const Path& file) { return tools::read_scene_file(file.native()); });
  check_reader(folder / "", "rays", ".rays", [](const Path& file) { return tools::read_rays(file); });
  check_reader(folder / "", "hits", ".hits", [](const Path& file) { return tools::read_hits(file); });
  check_reader(folder / "", "paths", ".paths", [](const Path& file) { return tools::read_paths(file); });
  // Points, spheres, boxes, and points of numpy.
  check_reader(folder / "", "queries", ".queries", [](const Path& file) {
    auto queries = tools::read_queries(file, tools::QueryShape::kPoint);
    for (const auto shape : {tools::QueryShape::kSphere, tools::QueryShape::kBox})
      if (!queries && queries.error().code == build::ErrorCode::kInvalidInput)
        queries = tools::read_queries(file, shape);
    return queries;
  });
  for (const Path& file : seeds(folder / "", "picture", ".picture")) {
    const std::vector<std::byte> bytes = bytes_of(file);
    constexpr std::uint64_t kTexels = std::uint64_t{1} << 20;
    if (!tools::decode_picture(bytes, kTexels)) continue;
    check_every_allocation(file.filename().string(), kMost, [&] {
      return build::or_out_of_memory("to decode it", [&] { return tools::decode_picture(bytes, kTexels); });
    });
  }
}

TEST_CASE("allocations that fail: writers of rays, hits, queries and results") {
  const test::TempFolder folder;
  const Path file = folder / "a", npy = folder / "a.npy";
  const std::vector<Ray> rays(9);
  const std::vector<tools::HitRecord> hits(9);
  const std::vector<tools::PathRecord> paths(18);
  const std::vector<std::byte> records(9 * sizeof(tools::PointRecord));
  const std::vector<std::uint64_t> first{0, 4, 9};
  const std::array<std::uint64_t, 1> shape{9};
  const tools::QueryBatch points{tools::QueryShape::kPoint, std::vector<float>(27)};
  check_every_allocation("write_rays", kMost, [&] { return tools::write_rays(file, false, rays); });
  check_every_allocation("write_hits", kMost, [&] { return tools::write_hits(file, hits); });
  check_every_allocation("write_paths", kMost, [&] { return tools::write_paths(file, 9, 2, paths); });
  check_every_allocation("write_queries", kMost, [&] { return tools::write_queries(file, points); });
  check_every_allocation("write_results", kMost, [&] { return tools::write_results(file, 9, 1, records); });
  check_every_allocation("write_lists", kMost, [&] { return tools::write_lists(file, first, records); });
  check_every_allocation("write_npy_results", kMost,
                         [&] { return tools::write_npy_results(npy, tools::NpyRecord::kPoint, shape, records); });
  check_every_allocation("write_npy_lists", kMost,
                         [&] { return tools::write_npy_lists(npy, tools::NpyRecord::kPoint, first, records); });
  check_every_allocation("write_npy_paths", kMost, [&] { return tools::write_npy_paths(npy, 9, 2, records); });
  CHECK(folder.names() == std::vector<std::string>{"a", "a.npy"});
}

TEST_CASE("allocations that fail: geometries of shapes, data of parts") {
  tools::ShapeSet balls{.name = "balls", .kind = ShapeKind::kSpheres}, hair{.name = "hair", .kind = ShapeKind::kCurves},
      flap{.name = "flap", .kind = ShapeKind::kMovingTriangles};
  balls.points.assign(50, {{0, 0, 0}, 1});
  hair.points.assign(50, {{0, 0, 0}, 1});
  hair.segments = {0, 1, 2, 7};
  flap.points = {{{0, 0, 0}, 0}, {{1, 0, 0}, 0}, {{0, 1, 0}, 0}, {{0, 0, 1}, 1}, {{1, 0, 1}, 1}, {{0, 1, 1}, 1}};
  flap.segments = {0, 1, 2};
  flap.keys = 2;
  const std::vector<const tools::ShapeSet*> sets{&balls, &hair, &flap};
  check_every_allocation("ShapeGeometries", kMost, [&] { return tools::ShapeGeometries::make(sets, 1); });
  // Manifests of parts are JSON.
  const build::Buffer bvh = fuzz::part_bvh();
  const BufferView view = *open_buffer(std::as_const(bvh).bytes());
  const tools::PartData data = fuzz::part_data();
  const auto bytes = tools::encode(data);
  check_every_allocation("encode(part data)", kMost, [&] {
    return build::or_out_of_memory("to encode it",
                                   [&]() -> build::Result<std::vector<std::byte>> { return tools::encode(data); });
  });
  check_every_allocation("decode_part_data", kMost, [&] {
    return build::or_out_of_memory("to decode it", [&] { return tools::decode_part_data(bytes, view); });
  });
}

TEST_CASE("a program without memory for its message ends with the status of a failure and says so") {
  const char* const arguments[] = {"program"};
  std::set<std::string> texts;
  for (const Failing failing : {Failing::kOne, Failing::kRest})
    for (unsigned number = 0; number < 8; ++number) {
      tools::Cli cli({"program", "A program.", ""});
      int status = -1;
      const std::string printed = printed_errors([&] {
        status = cli.run(1, arguments, [&]() -> build::Result<void> {
          start_failing(number, failing);
          throw std::bad_alloc();
        });
        stop_failing();
      });
      CHECK(status == tools::kExitFailure);
      texts.insert(std::regex_replace(printed, std::regex("[0-9]+"), "N"));
    }
  // The other two are from where there was no memory for the first one.
  const std::string free = build::free_memory() ? ": N bytes free" : "";
  CHECK(texts == std::set<std::string>{"program: not enough memory to finish" + free + "\n",
                                       "program: not enough memory\n", "program: out of memory\n"});
}

TEST_CASE("allocations that fail: pictures") {
  const oracle::Mesh star = oracle::star(3, kFaultSeed);
  const std::vector<oracle::Mesh> meshes{star};
  const auto bvh = build::build(oracle::views(meshes), {.threads = 1});
  REQUIRE(bvh.has_value());
  const auto file = open_scene(bvh->buffer.bytes());
  REQUIRE(file.has_value());
  const tools::Camera camera = tools::automatic_camera(file->view().header->bounds, 1.0);
  tools::PathOptions options;
  options.width = options.height = 8;
  options.samples = 2;
  options.threads = 1;
  auto sky = tools::make_sky([](const Vec3&) { return Vec3(1.0f); }, 4);
  const auto data = tools::make_path_data(file->view(), nullptr, std::move(sky), std::vector<Vec3>(4), 0.0f);
  REQUIRE(data.has_value());
  check_every_allocation("make_path_data", kMost,
                         [&] { return tools::make_path_data(file->view(), nullptr, {}, {}, 0.0f); });
  check_every_allocation("trace_paths", kMost,
                         [&] { return tools::trace_paths(file->scene(), *data, camera, options); });
  tools::RenderOptions studio;
  studio.width = studio.height = 16;
  studio.samples = 1;
  studio.threads = 1;
  check_every_allocation("render", kMost, [&] { return tools::render(file->scene(), camera, studio, {}, nullptr); });
}

TEST_CASE("allocations that fail: pictures of textures, cut-outs, lights and triangles that move") {
  tools::Material leaf, lamp;
  leaf.base_color_texture.texture = leaf.metallic_roughness_texture.texture = 0;
  leaf.alpha_cutoff = 0.5f;
  lamp.emission = {5, 5, 5};
  lamp.emission_texture.texture = 1;
  const oracle::Mesh square = test::floor_square(2.0f);
  oracle::Mesh above = square;
  for (auto& p : above.positions) p[1] += 3.0f;
  test::PathTestScene scene =
      test::scene_with_motion({square, above}, {{0, 1}, {square, above}}, {leaf, lamp, tools::Material{}});
  scene.surfaces.textures = {{"mask", 4, 1, {0xff808080u, 0x00808080u, 0xff808080u, 0x00808080u}},
                             {"glow", 1, 1, {0xffffffffu}}};
  auto& geometries = scene.surfaces.objects[0];
  for (unsigned i : {0u, 1u}) geometries[i].coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  geometries[0].normals.assign(4, {0, 1, 0});
  scene = test::in_instances(std::move(scene), std::vector<build::Instance>(3));
  const BufferView view = scene.view();
  check_every_allocation("make_path_data with textures", kMost,
                         [&] { return tools::make_path_data(view, &scene.surfaces, {}, {}, 0.5f); });
  const tools::PathData data = test::data_of(scene, [](const Vec3&) { return Vec3(1.0f); });
  REQUIRE(tools::has_alpha_cutout(data));
  REQUIRE(!data.light_instances.empty());
  const auto file = open_scene(std::as_const(scene.file).bytes());
  REQUIRE(file.has_value());
  const tools::Camera camera = tools::automatic_camera(view.header->bounds, 1.0);
  tools::PathOptions options;
  options.width = options.height = 8;
  options.samples = 2;
  options.threads = 1;
  check_every_allocation("trace_paths with textures", kMost,
                         [&] { return tools::trace_paths(file->scene(), data, camera, options); });
  check_every_allocation("store_surfaces", kMost, [&]() -> build::Result<tools::Image> {
    return build::or_out_of_memory("for the picture", [&]() -> build::Result<tools::Image> {
      tools::Image image(8, 8);
      if (auto stored = tools::store_surfaces(file->scene(), data, camera, options, image); !stored)
        return tl::unexpected(stored.error());
      return image;
    });
  });
}
