#include <hiprt_build/pair/edges.h>
#include <hiprt_build/pair/weld.h>

#include <bit>

namespace hiprt::build {

ScratchArray<HalfEdge> find_partners(CpuEngine& engine, const TriangleMesh& mesh,
                                     std::span<const std::uint8_t> dropped) {
  const std::size_t vertices = mesh.positions.size(), triangles = mesh.triangles.size();
  auto welded = engine.allocate<std::uint32_t>(vertices);
  {
    auto table = engine.allocate<std::uint32_t>(std::bit_ceil(2 * vertices + 1));
    engine.fill(table.span(), kInvalidId);
    engine.for_each(WeldStep::blocks(vertices), WeldStep{mesh.positions, table.span(), welded.span()});
  }
  auto cursor = engine.allocate<std::uint32_t>(vertices);
  engine.fill(cursor.span(), 0u);
  engine.for_each(triangles, ListEdgesStep{mesh, welded.span(), dropped, cursor.span(), {}});
  auto entries = engine.allocate<ListedEdge>(engine.exclusive_scan(cursor.span()));
  engine.for_each(triangles, ListEdgesStep{mesh, welded.span(), dropped, cursor.span(), entries.span()});
  welded.release();
  auto partner = engine.allocate<HalfEdge>(3 * triangles);
  engine.fill(partner.span(), kInvalidId);
  engine.for_each(vertices, MatchEdgesStep{engine.monitor(), mesh, cursor.span(), entries.span(), partner.span()});
  return partner;
}

}  // namespace hiprt::build
