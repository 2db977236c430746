// Rounds of reinsertion on the device: they end when the tree is high, and a tree that no file can hold is given up.

#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/pair/pair.h>
#include <hiprt_build/reinsert/gpu_reinsert.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <hiprt_build/tree/link.h>
#include <tests/build/machine.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/mesh.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::build;
using namespace hiprt::checks;

namespace {

/// A linked tree of the host's builder sbvh.
struct HostTree {
  Machine machine;
  std::vector<Reference> references;
  std::vector<LinkedNode> nodes;
  LinkedRef root = kInvalidId;

  explicit HostTree(const oracle::Mesh& mesh) {
    const std::vector<TriangleMesh> views{mesh.view()};
    const BuildInput input(SceneInput{views, {}});
    const PairedPrimitives leaves = pair_primitives(machine.engine, input, false);
    auto whole = machine.engine.allocate<Reference>(leaves.count);
    for (std::size_t i = 0; i < leaves.count; ++i)
      MakeReferenceStep{input.table(), leaves.leaves.span(), whole.span()}(i);
    const DepthFirstTree tree = build_sbvh(machine.engine, input.table(), std::move(whole), 3.0, kHqDefaults.splits);
    const auto parts = tree.references.span();
    references.assign(parts.begin(), parts.end());
    nodes.assign(references.size(), LinkedNode{{}, {kInvalidId, kInvalidId}});
    std::vector<std::uint32_t> counts(references.size());
    const LinkNodeStep link{tree.nodes.span(), 0, nodes, counts};
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) link(i);
    root = link.ref(0);
  }
};

struct Outcome {
  std::vector<LinkedNode> nodes;
  std::uint32_t need = 0;  ///< Stack entries.

  double area(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) != 0) return 0;
    const LinkedNode& node = nodes[ref];
    return double{half_area(node.box)} + area(node.child[0]) + area(node.child[1]);
  }
  /// Nodes on the longest path, a leaf included.
  std::uint32_t height(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) != 0) return 1;
    return 1 + std::max(height(nodes[ref].child[0]), height(nodes[ref].child[1]));
  }
  bool has_links_of(const std::vector<LinkedNode>& others) const {
    return std::equal(nodes.begin(), nodes.end(), others.begin(), others.end(), [](const auto& a, const auto& b) {
      return a.child[0] == b.child[0] && a.child[1] == b.child[1];
    });
  }
};

/// @param before references before splits; 0: not known.
Outcome finish(const HostTree& tree, unsigned rounds, std::uint32_t most_height, gpu::LongStep asks = {},
               Result<void>* result = nullptr, std::uint32_t before = 0) {
  CountingAllocator allocator;
  const auto n = static_cast<std::uint32_t>(tree.references.size());
  auto references = must(gpu::DeviceArray<Reference>::from(tree.references, nullptr, allocator));
  auto nodes = must(gpu::DeviceArray<LinkedNode>::from(tree.nodes, nullptr, allocator));
  auto plans = must(gpu::DeviceArray<CollapsePlan>::make(n, nullptr, allocator));
  auto root = must(gpu::DeviceArray<LinkedRef>::from(std::vector{tree.root}, nullptr, allocator));
  auto scratch = must(gpu::DeviceArray<std::byte>::make(gpu::finish_tree_scratch(n, rounds), nullptr, allocator));
  auto count = must(gpu::DeviceArray<std::uint32_t>::from(std::vector{before}, nullptr, allocator));
  must(plans.fill(std::byte{0xa5}, nullptr));
  must(scratch.fill(std::byte{0xa5}, nullptr));
  const PlannedTree planned{
      {references.data()}, nodes.data(), {plans.data(), references.data(), {1.0f, 1.0f, 1.0f, 8}}, root.data()};
  const auto done = gpu::enqueue_finish_tree(
      {planned, n, nullptr, rounds, before != 0 ? count.data() : nullptr, most_height}, scratch.data(), nullptr, asks);
  if (result != nullptr)
    *result = done;
  else
    must(done);
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  return Outcome{must(nodes.to_vector(nullptr)), must(plans.to_vector(nullptr))[tree.root].need};
}

}  // namespace

TEST_CASE("reinsertion on the device ends when the tree is high, and keeps what it has gained") {
  const HostTree tree(oracle::fan(1500));
  const Outcome before = finish(tree, 0, kMostReinsertionHeight);
  CHECK(before.has_links_of(tree.nodes));
  Outcome last = before;
  bool ended = false;
  for (const unsigned rounds : {4u, 8u, 12u, 16u, 20u}) {
    const Outcome now = finish(tree, rounds, kMostReinsertionHeight);
    CAPTURE(rounds, now.height(tree.root), now.need, now.area(tree.root), last.area(tree.root));
    CHECK(now.need <= kMaxStackBound);
    if (ended) CHECK(now.has_links_of(last.nodes));
    if (!ended) CHECK(now.area(tree.root) < last.area(tree.root));
    // The round that makes a tree high is the last.
    ended = now.height(tree.root) > kMostReinsertionHeight && rounds != 4;
    last = now;
  }
  CHECK(ended);
}

TEST_CASE("reinsertion on the device makes fewer rounds where splits have more than doubled the references") {
  const HostTree tree(oracle::soup(300, 0.3, 20261130));
  const auto n = static_cast<std::uint32_t>(tree.references.size());
  const auto after = [&](unsigned rounds, std::uint32_t before) {
    return finish(tree, rounds, kMostReinsertionHeight, {}, nullptr, before);
  };
  const Outcome all = after(9, 0), few = after(6, 0);
  CHECK_FALSE(all.has_links_of(few.nodes));
  CHECK(after(9, n / 2 + 1).has_links_of(all.nodes));
  const std::uint32_t third = n / 3 + 1;
  REQUIRE(build::usual_rounds(9, third, n) == 6);
  CHECK(after(9, third).has_links_of(few.nodes));
}

TEST_CASE("a tree that reinsertion makes too deep for a file becomes again what it was") {
  const HostTree tree(oracle::fan(4000));
  const Outcome high = finish(tree, 16, 100'000);
  // Chains of so many levels need as many entries.
  CHECK(high.need <= kMaxStackBound);
  CHECK(high.has_links_of(tree.nodes));
  CHECK(high.area(tree.root) == finish(tree, 0, 100'000).area(tree.root));
  CHECK_FALSE(finish(tree, 3, 100'000).has_links_of(tree.nodes));
}

TEST_CASE("reinsertion asks between its rounds whether to go on") {
  const HostTree tree(oracle::soup(300, 0.3, 20261129));
  const auto n = tree.references.size();
  std::vector<double> asked;
  const build::ProgressCallback note = [&](const build::Progress& progress) {
    CHECK(std::string(progress.step) == "reinsert");
    asked.push_back(progress.fraction);
    return true;
  };
  const Outcome expected = finish(tree, 8, kMostReinsertionHeight);
  const Outcome all = finish(tree, 8, kMostReinsertionHeight, gpu::LongStep(note, "reinsert", 0.5, 0.8, 1));
  CHECK(all.has_links_of(expected.nodes));
  CHECK(asked.size() == 7);
  CHECK(std::is_sorted(asked.begin(), asked.end()));
  CHECK((asked.front() > 0.5 && asked.back() < 0.8));
  asked.clear();
  finish(tree, 8, kMostReinsertionHeight, gpu::LongStep(note, "reinsert", 0.5, 0.8, 3 * n));
  CHECK(asked.size() == 2);
  unsigned calls = 0;
  const build::ProgressCallback stop = [&](const build::Progress&) { return ++calls < 3; };
  Result<void> result{};
  finish(tree, 8, kMostReinsertionHeight, gpu::LongStep(stop, "reinsert", 0.5, 0.8, 1), &result);
  CHECK(calls == 3);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == ErrorCode::kCancelled);
  CHECK(result.error().message == "the build was cancelled in step reinsert");
}
