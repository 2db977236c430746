/// Parts of a scene on a GPU: their answers are the CPU's, with cut-outs, motion and nested instances.

#include <tests/render/part_scenes.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <algorithm>
#include <span>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

TEST_CASE("a GPU's answers for parts of a scene are the CPU's") {
  const Camera camera{{1.0, 2.0, 7.0}, {0, 0, 0}, {0, 1, 0}, 50};
  const PathSettings settings = settings_of({.width = 24, .height = 16, .shutter = {0.0f, 1.0f}}, camera);
  for (const PartSceneOptions options :
       {PartSceneOptions{.groups = 2}, PartSceneOptions{.groups = 0, .cutout = false, .moving = false}}) {
    CAPTURE(options.groups);
    const PartedScene parts(12, options, true, 2);
    std::vector<Ray> rays;
    for (std::uint32_t y = 0; y < 16; ++y)
      for (std::uint32_t x = 0; x < 24; ++x) rays.push_back(settings.camera.ray(x + 0.5, y + 0.5));
    std::size_t hits = 0;
    for (const ScenePart& part : parts.manifest().parts) {
      const auto make = [&] {
        auto files = parts.load(part);
        auto made = PartTracer::make(std::move(files.bvh), std::move(files.data), parts.manifest().levels, settings);
        REQUIRE(made.has_value());
        return std::move(*made);
      };
      const auto cpu = make(), gpu = make();
      auto tracer = GpuTracer::make(gpu->view());
      INFO((tracer ? std::string() : tracer.error().message));
      REQUIRE(tracer.has_value());
      REQUIRE(gpu->move_to(std::move(*tracer)).has_value());
      for (const Query query : {Query::kClosest, Query::kAny}) {
        const auto expected = cpu->trace(query, rays), found = gpu->trace(query, rays);
        REQUIRE((expected.has_value() && found.has_value()));
        CHECK(expected->results == found->results);
        CHECK(expected->paths == found->paths);
        REQUIRE(expected->hits.size() == found->hits.size());
        const auto a = std::as_bytes(std::span(expected->hits)), b = std::as_bytes(std::span(found->hits));
        CHECK(std::equal(a.begin(), a.end(), b.begin()));
        hits += found->hits.size();
      }
    }
    CHECK(hits > 0);
  }
}
