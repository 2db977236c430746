#include "overlapping.h"

#include "bench_data.h"

#include <benchmarks/common/markdown.h>
#include <benchmarks/common/overlapping_meshes.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

namespace hiprt::bench {
namespace {

using build::Result;

Result<Measured> measure_overlapping(const std::string& mesh_name, std::uint32_t count, const std::string& builder,
                                     const MeshBench& bench, hipStream_t stream) {
  const oracle::Mesh made = make_overlapping(mesh_name, count);
  const auto mesh = DeviceMesh::make(mesh_name, made.positions, made.triangles);
  if (!mesh) return tl::unexpected(mesh.error());
  return measure(*mesh, builder, bench, stream);
}

}  // namespace

bool run_overlapping(const OverlapBench& bench, hipStream_t stream, nlohmann::json& results) {
  MarkdownTable table({"triangles", "mesh", "builder", "ms", "/ scattered", "/ a quarter", "callback gap ms"});
  bool good = true;
  for (const std::string& text : bench.counts)
    for (const std::string& builder : bench.builders) {
      const std::uint32_t count = parse_count(text);
      const auto builds = [&](const std::string& mesh, std::uint32_t triangles) {
        const auto measured = triangles != 0 ? measure_overlapping(mesh, triangles, builder, bench.meshes, stream)
                                             : gpu::fail(build::ErrorCode::kInvalidInput, "not a number of triangles");
        if (measured) return *measured;
        std::cerr << "bench_gpu_build: " << text << " triangles, " << mesh << ", " << builder << ": "
                  << measured.error().message << "\n";
        good = false;
        Measured unknown;
        unknown.median_ms = unknown.callback_gap_ms = std::nan("");
        return unknown;
      };
      const double scattered = builds("scattered", count).median_ms;
      if (count == 0) continue;
      for (const char* mesh : kOverlapping) {
        const Measured whole = builds(mesh, count);
        const double all = whole.median_ms, quarter = builds(mesh, std::max(1u, count / 4)).median_ms;
        table.add({text, mesh, builder, format_number(all, 3), format_number(all / scattered, 2),
                   format_number(all / quarter, 2), format_number(whole.callback_gap_ms, 1)});
        results.push_back({{"triangles", count},
                           {"mesh", mesh},
                           {"builder", builder},
                           {"median_ms", all},
                           {"quarter_ms", quarter},
                           {"callback_gap_ms", whole.callback_gap_ms},
                           {"scattered_ms", scattered}});
      }
    }
  if (!bench.counts.empty()) std::cout << table.text();
  return good;
}

}  // namespace hiprt::bench
