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

Result<double> median_of_overlapping(const std::string& mesh_name, std::uint32_t count, const std::string& builder,
                                     const MeshBench& bench, hipStream_t stream) {
  const oracle::Mesh made = make_overlapping(mesh_name, count);
  const auto mesh = DeviceMesh::make(mesh_name, made.positions, made.triangles);
  if (!mesh) return tl::unexpected(mesh.error());
  const auto measured = measure(*mesh, builder, bench, stream);
  if (!measured) return tl::unexpected(measured.error());
  return measured->median_ms;
}

}  // namespace

bool run_overlapping(const OverlapBench& bench, hipStream_t stream, nlohmann::json& results) {
  MarkdownTable table({"triangles", "mesh", "builder", "ms", "/ scattered", "/ a quarter"});
  bool good = true;
  for (const std::string& text : bench.counts)
    for (const std::string& builder : bench.builders) {
      const std::uint32_t count = parse_count(text);
      const auto time = [&](const std::string& mesh, std::uint32_t triangles) -> double {
        const auto median = triangles != 0 ? median_of_overlapping(mesh, triangles, builder, bench.meshes, stream)
                                           : gpu::fail(build::ErrorCode::kInvalidInput, "not a number of triangles");
        if (median) return *median;
        std::cerr << "bench_gpu_build: " << text << " triangles, " << mesh << ", " << builder << ": "
                  << median.error().message << "\n";
        good = false;
        return std::nan("");
      };
      const double scattered = time("scattered", count);
      if (count == 0) continue;
      for (const char* mesh : kOverlapping) {
        const double all = time(mesh, count), quarter = time(mesh, std::max(1u, count / 4));
        table.add({text, mesh, builder, format_number(all, 3), format_number(all / scattered, 2),
                   format_number(all / quarter, 2)});
        results.push_back({{"triangles", count},
                           {"mesh", mesh},
                           {"builder", builder},
                           {"median_ms", all},
                           {"quarter_ms", quarter},
                           {"scattered_ms", scattered}});
      }
    }
  if (!bench.counts.empty()) std::cout << table.text();
  return good;
}

}  // namespace hiprt::bench
