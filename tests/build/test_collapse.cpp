// Collapse to four children against an exhaustive search. Its predicted cost must equal the cost measured from the
// file.

#include <hiprt_build/collapse/collapse.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/statistics.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::oracle;
using build::DepthFirstTree;
using build::SahCosts;

namespace {

double area(const DepthFirstTree& tree, std::uint32_t node) { return double{build::half_area(tree.nodes[node].box)}; }

/// The least cost over every wide tree, by trying them.
class AllCollapses {
 public:
  AllCollapses(const DepthFirstTree& tree, const SahCosts& costs, unsigned max_primitives)
      : tree_(tree), costs_(costs), max_primitives_(max_primitives) {}

  /// The subtree as one child.
  double best(std::uint32_t node) const {
    const std::size_t count = tree_.nodes[node].count;
    const bool custom = contents(node, 0).is_custom();
    const double run = area(tree_, node) * (custom ? costs_.custom : costs_.leaf) * static_cast<double>(count);
    if (count == 1) return run;
    const double inner =
        area(tree_, node) * costs_.box_node + best_spatial_split({tree_.left(node), tree_.right(node)}, 0);
    return primitives(node) <= max_primitives_ && one_kind(node) ? std::min(run, inner) : inner;
  }

 private:
  build::LeafContents contents(std::uint32_t node, std::uint32_t i) const {
    return tree_.references[tree_.nodes[node].first + i].contents;
  }
  unsigned primitives(std::uint32_t node) const {
    unsigned sum = 0;
    for (std::uint32_t i = 0; i < tree_.nodes[node].count; ++i) sum += contents(node, i).is_pair() ? 2 : 1;
    return sum;
  }
  bool one_kind(std::uint32_t node) const {
    unsigned customs = 0;
    for (std::uint32_t i = 0; i < tree_.nodes[node].count; ++i) customs += contents(node, i).is_custom() ? 1 : 0;
    return customs == 0 || customs == tree_.nodes[node].count;
  }

  /// Children as they are, or with one of those from @p from on opened.
  double best_spatial_split(const std::vector<std::uint32_t>& children, std::size_t from) const {
    double least = 0;
    for (const std::uint32_t child : children) least += best(child);
    if (children.size() == kBranching) return least;
    for (std::size_t i = from; i < children.size(); ++i) {
      if (tree_.nodes[children[i]].count == 1) continue;
      std::vector<std::uint32_t> opened = children;
      opened[i] = tree_.left(children[i]);
      opened.insert(opened.begin() + static_cast<std::ptrdiff_t>(i) + 1, tree_.right(children[i]));
      least = std::min(least, best_spatial_split(opened, i));
    }
    return least;
  }

  const DepthFirstTree& tree_;
  SahCosts costs_;
  unsigned max_primitives_;
};

}  // namespace

TEST_CASE("the collapse has the least cost of all possible collapses") {
  const build::ProgressCallback no_progress;
  build::Monitor monitor(no_progress);
  build::MemoryLedger ledger;
  build::CpuEngine engine(monitor, ledger);
  constexpr std::uint64_t kSeed = 17;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (unsigned round = 0; round < 300; ++round) {
    const std::uint32_t count = 2 + random.below(11);
    auto references = engine.allocate<build::Reference>(count);
    // Triangles, custom primitives, or both: every third round each.
    for (build::Reference& reference : references.span()) {
      const bool custom = round % 3 == 1 || (round % 3 == 2 && random.below(3) == 0);
      const bool is_pair = random.coin();
      reference.contents = build::LeafContents::make(is_pair ? 1 : 0, custom ? build::LeafContents::kCustom : 0, 0);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const Position low = random.in_cube(1), size = random.in_cube(random.log_uniform(1e-3, 1));
      build::Reference& r = references[i];
      r.primitive = i;
      for (std::size_t k = 0; k < 3; ++k) r.box.min[k] = low[k], r.box.max[k] = low[k] + std::abs(size[k]);
    }
    const DepthFirstTree tree = build_sah(engine, std::move(references));
    const SahCosts costs{1.0f, random.uniform_float(0.2, 3), random.uniform_float(0.2, 3)};
    const unsigned max_primitives = 1 + random.below(10);
    const build::WideTree wide(engine, tree, costs, max_primitives);
    CAPTURE(round, count, costs.leaf, costs.custom, max_primitives);
    REQUIRE(wide.cost() * area(tree, 0) == Approx(AllCollapses(tree, costs, max_primitives).best(0)).epsilon(1e-5));
  }
}

TEST_CASE("the collapse predicts the cost that is measured in the file") {
  for (const Mesh& mesh : {icosphere(4), star(4, 9), soup(5000, 0.1, 10), needles(2000, 1e3, 11)})
    for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes}) {
      const SahCosts costs{1.0f, 1.7f, 1.0f};
      const auto bvh = build::build(std::vector{mesh.view()}, {.nodes = layout, .costs = costs});
      REQUIRE(bvh.has_value());
      const auto view = open_buffer(bvh->buffer.bytes());
      REQUIRE(view.has_value());
      const std::string text(view->provenance);
      const std::size_t at = text.find("\"sah_cost\":");
      REQUIRE(at != std::string::npos);
      CHECK(std::stod(text.substr(at + 11)) == Approx(build::measure_tree(*view, costs).sah_cost).epsilon(1e-4));
    }
}
