// The quality figures of a refit, and when it advises a rebuild.

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/statistics.h>
#include <tests/build/refit_file.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/nodes_of.h>
#include <tests/oracle/odd_meshes.h>

#include <cstring>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::test;
using build::Builder;

namespace {

/// Replaces the file's provenance with a text.
void set_provenance(File& file, std::string text) {
  const BufferView view = file.view();
  text.resize(view.provenance.size(), ' ');
  std::memcpy(file.bytes().data() + view.provenance_entry.offset, text.data(), text.size());
  reinterpret_cast<FileHeader*>(file.bytes().data())->checksum = file_checksum(file.bytes());
}

/// TreeStatistics::exchange_slack from its definition.
double slack_of(const BufferView& view) {
  const auto nodes = oracle::nodes_of<PlanesBoxNode>(view);
  const auto area = [](const Box& box) {
    const double x = double{box.max[0]} - double{box.min[0]}, y = double{box.max[1]} - double{box.min[1]},
                 z = double{box.max[2]} - double{box.min[2]};
    return x * y + y * z + z * x;
  };
  double saved = 0, all = 0;
  for (const PlanesBoxNode& parent : nodes)
    for (unsigned c = 0; c < kBranching; ++c) {
      if (parent.child[c] == kInvalidRef || !is_box(parent.child[c])) continue;
      const PlanesBoxNode& child = nodes[view.node_number(parent.child[c])];
      std::vector<Box> nephews, siblings;
      for (unsigned k = 0; k < kBranching; ++k) {
        if (child.child[k] != kInvalidRef) nephews.push_back(PlanesLayout::box(child, k));
        if (k != c && parent.child[k] != kInvalidRef) siblings.push_back(PlanesLayout::box(parent, k));
      }
      const double before = area(PlanesLayout::box(parent, c));
      double best = before;
      for (std::size_t out = 0; out < nephews.size(); ++out)
        for (const Box& in : siblings) {
          std::vector<Box> exchanged = nephews;
          exchanged[out] = in;
          Box box = in;
          for (const Box& part : exchanged) format_detail::grow(box, part);
          best = std::min(best, area(box));
        }
      saved += before - best;
      all += before;
    }
  return all > 0 ? saved / all : 0;
}

}  // namespace

TEST_CASE("every refit is compared with the tree as built") {
  const Mesh mesh = unshared(star(5, kSeed));
  for (const NodeLayout layout : kLayouts) {
    CAPTURE(static_cast<std::uint32_t>(layout));
    const build::SahCosts costs{.box_node = 2, .leaf = 1};
    File file = built(mesh, {.builder = Builder::kSah, .nodes = layout, .pair_triangles = false, .costs = costs});
    const build::TreeStatistics tree = build::measure_tree(file.view(), costs);
    const auto check = [&](const Mesh& moved, bool advised) {
      const build::RefitStatistics s = refitted(file, moved);
      CHECK(s.sah_cost_built == Approx(tree.sah_cost).epsilon(layout == NodeLayout::kPlanes ? 1e-4 : 0.05));
      CHECK(s.exchange_slack_built == Approx(tree.exchange_slack).margin(1e-6));
      const build::TreeStatistics now = build::measure_tree(file.view(), costs);
      CHECK(s.sah_cost == Approx(now.sah_cost));
      CHECK(s.exchange_slack == Approx(now.exchange_slack).margin(1e-9));
      CHECK(s.cost_ratio == Approx(s.sah_cost / s.sah_cost_built));
      CHECK(s.rebuild_advised == advised);
      return s.cost_ratio;
    };
    CHECK(check(mesh, false) == Approx(1).epsilon(0.05));
    // Halves cannot resolve shapes that are much smaller or larger.
    for (const double scale : {1e-20, 1e-3, 3.0, 1e15})
      if (layout != NodeLayout::kHalf || (scale > 1e-4 && scale < 1e4)) CHECK(check(placed(mesh, scale), false) < 1.06);
    check(exploded(mesh, 2, kSeed), true);
    check(scattered(mesh, 0.01, 3, kSeed), true);
    check(twisted(mesh, 0.05), false);
    CHECK(check(mesh, false) == Approx(1).epsilon(0.05));
  }
}

TEST_CASE("exchange slack matches its definition: small after a build, larger after random motions") {
  for (const Builder builder : {Builder::kSah, Builder::kLbvh, Builder::kHploc}) {
    const Mesh mesh = soup(5000, 0.1, kSeed);
    CAPTURE(build::name(builder));
    File file = built(mesh, {.builder = builder, .pair_triangles = false});
    const double before = build::measure_tree(file.view()).exchange_slack;
    CHECK(before == Approx(slack_of(file.view())));
    CHECK(before < 0.05);
    CHECK(file.view().provenance.find("\"exchange_slack\":0.0") != std::string_view::npos);
    CHECK(refitted(file, mesh).exchange_slack_built == Approx(before).margin(1e-6));
    refitted(file, scattered(mesh, 0.05, 2, kSeed));
    const double after = build::measure_tree(file.view()).exchange_slack;
    CHECK(after == Approx(slack_of(file.view())));
    CHECK(after > 0.2);
  }
}

TEST_CASE("split references get the boxes of whole triangles, and the cost ratio shows it") {
  const Mesh mesh = needles(5000, 1e3, kSeed);
  for (const Builder builder : {Builder::kHq, Builder::kSbvh, oracle::kEmbreeHigh}) {
    CAPTURE(build::name(builder));
    File file = built(mesh, {.builder = builder, .split_budget = 3});
    REQUIRE(file.has_splits());
    const build::RefitStatistics s = refitted(file, mesh, {.rebuild_slack = 1, .rebuild_ratio = 1.05});
    CHECK(s.cost_ratio > 1.05);
    CHECK(s.rebuild_advised);
    CHECK_FALSE(refitted(file, mesh, {.rebuild_slack = 1, .rebuild_ratio = 1000}).rebuild_advised);
    File whole = built(mesh, {.builder = builder, .split_budget = 1});
    CHECK_FALSE(whole.has_splits());
    CHECK(refitted(whole, mesh).cost_ratio == Approx(1).epsilon(1e-4));
  }
}

TEST_CASE("a file without costs in its provenance is measured before the refit") {
  const Mesh mesh = unshared(star(4, kSeed)), worse = exploded(mesh, 2, kSeed);
  for (const std::string text :
       {"{}", "{\"statistics\":7}", "{\"statistics\":{\"sah_cost\":null,\"exchange_slack\":2}}",
        "{\"statistics\":{\"sah_cost\":-1}}", "{\"statistics\":{\"sah_cost\":\"12\"}}", "{[}",
        "{\"statistics\":{\"sah_cost\":1e999}}",
        "{\"options\":{\"cost_leaf\":1e300,\"cost_box_node\":-2,\"cost_custom\":[]}}"}) {
    CAPTURE(text);
    File file = built(mesh, {.pair_triangles = false});
    set_provenance(file, text);
    const build::TreeStatistics before = build::measure_tree(file.view());
    const build::RefitStatistics first = refitted(file, worse);
    CHECK(first.sah_cost_built == Approx(before.sah_cost));
    CHECK(first.exchange_slack_built == Approx(before.exchange_slack));
    CHECK(first.rebuild_advised);
    const build::RefitStatistics second = refitted(file, worse);
    CHECK(second.cost_ratio == Approx(1));
    CHECK_FALSE(second.rebuild_advised);
  }
  File file = built(mesh);
  set_provenance(file, "{\"statistics\":{\"sah_cost\":1e-3,\"exchange_slack\":0.5}}");
  const build::RefitStatistics s = refitted(file, mesh);
  CHECK(s.cost_ratio > 1000);
  CHECK(s.exchange_slack_built == 0.5);
}
