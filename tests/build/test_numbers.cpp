// Builds at the limits of counts and sizes. The input arrays are mapped memory without pages, so no large memory is
// needed.

#include <hiprt_build/encode/encode.h>
#include <hiprt_build/exec/scratch.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/pair/edges.h>
#include <hiprt_build/reinsert/reinsert_steps.h>
#include <tests/build/machine.h>

#include <tests/catch.h>

#include <sys/mman.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::build;
using Catch::Contains;

namespace {

constexpr std::size_t kMostTriangles = (std::size_t{1} << 30) - 1, kMostVertices = (std::size_t{1} << 31) - 1;

/// Zeros; pages that nobody writes take no memory.
template <class T> class Sparse {
 public:
  explicit Sparse(std::size_t size) : size_(size) {
    void* const memory =
        ::mmap(nullptr, size * sizeof(T), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory != MAP_FAILED) data_ = static_cast<T*>(memory);
  }
  Sparse(const Sparse&) = delete;
  Sparse& operator=(const Sparse&) = delete;
  ~Sparse() {
    if (data_ != nullptr) ::munmap(data_, size_ * sizeof(T));
  }
  bool there() const { return data_ != nullptr; }
  std::span<T> span() { return {data_, size_}; }
  T& operator[](std::size_t i) { return data_[i]; }

 private:
  std::size_t size_;
  T* data_ = nullptr;
};

/// Some systems give no more address space than memory. tools/check lists the line.
template <class... Arrays> bool all_there(const Arrays&... arrays) {
  const bool there = (arrays.there() && ...);
  if (!there) std::puts("SKIPPED: the largest mesh: no address space for it");
  return there;
}

}  // namespace

TEST_CASE("half-edges of the last triangles and vertices of the largest mesh are matched") {
  Sparse<Position> positions(kMostVertices);
  Sparse<Triangle> triangles(kMostTriangles);
  Sparse<std::uint32_t> welded(kMostVertices), cursor(kMostVertices);
  Sparse<std::uint8_t> dropped(kMostTriangles);
  Sparse<ListedEdge> entries(3 * kMostTriangles);
  Sparse<HalfEdge> partner(3 * kMostTriangles);
  if (!all_there(positions, triangles, welded, cursor, dropped, entries, partner)) return;
  const TriangleMesh mesh{positions.span(), triangles.span()};
  const std::uint32_t a = kMostVertices - 4, b = a + 1, c = a + 2, d = a + 3;
  positions[b] = {1, 0, 0}, positions[c] = {0, 1, 0}, positions[d] = {1, 1, 0};
  const std::size_t one = kMostTriangles - 2, two = kMostTriangles - 1;
  triangles[one] = {a, b, c}, triangles[two] = {c, b, d};
  for (const std::uint32_t vertex : {a, b, c, d}) welded[vertex] = vertex;
  // As if all other half-edges were filed under vertices before: two of ours go under a, three under b, one under c.
  const auto first = static_cast<std::uint32_t>(3 * kMostTriangles - 6);
  cursor[a - 1] = first, cursor[a] = first, cursor[b] = first + 2, cursor[c] = first + 5, cursor[d] = first + 6;
  const ListEdgesStep file{mesh, welded.span(), dropped.span(), cursor.span(), entries.span()};
  for (const std::size_t triangle : {one, two}) file(triangle);
  CHECK(cursor[a] == first + 2);
  CHECK(cursor[b] == first + 5);
  CHECK(cursor[c] == first + 6);
  std::fill_n(&partner[3 * one], 6, kInvalidId);
  Machine machine;
  const MatchEdgesStep match{machine.monitor, mesh, cursor.span(), entries.span(), partner.span()};
  for (const std::uint32_t vertex : {a, b, c, d}) match(vertex);
  CHECK(partner[3 * one + 1] == static_cast<HalfEdge>(4 * two));
  CHECK(partner[3 * two] == static_cast<HalfEdge>(4 * one + 1));
  for (const std::size_t edge : {3 * one, 3 * one + 2, 3 * two + 1, 3 * two + 2}) CHECK(partner[edge] == kInvalidId);
}

TEST_CASE("primitives of several of the largest meshes are counted with 64 bits, and refused") {
  const Position position{};
  const Triangle triangle{};
  const Box box{};
  const std::vector<TriangleMesh> meshes(5, TriangleMesh{{&position, 3}, {&triangle, kMostTriangles}});
  const CustomGeometry customs[] = {{{&box, kMostTriangles}, 0}};
  const auto message = [](const SceneInput& scene) { return check_sizes(scene).error().message; };
  CHECK(message({meshes, customs}).find(std::to_string(6 * std::uint64_t{kMostTriangles}) + " primitives") == 0);
  CHECK(message({meshes, {}}).find(std::to_string(5 * std::uint64_t{kMostTriangles}) + " triangles") == 0);
  const BuildInput largest{SceneInput{std::span(meshes).first(1), customs}};
  CHECK(largest.geometries[1].first == kMostTriangles);
  CHECK(largest.primitive_count() == 2 * kMostTriangles);
}

TEST_CASE("splitting makes no more references than a file can address, for any budget") {
  CHECK(split_capacity(0, 16) == 0);
  CHECK(split_capacity(1, 1) == 1);
  CHECK(split_capacity(100'000'000, 1) == 100'000'000);
  CHECK(split_capacity(100'000'000, 1.5) == 150'000'000);
  CHECK(split_capacity(100'000'000, 16) == kMaxReferences);
  CHECK(split_capacity(kMaxReferences - 1, 1) == kMaxReferences - 1);
  CHECK(split_capacity(kMaxReferences, 16) == kMaxReferences);
  // That many fit, and not one more: the first node lies before them.
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kQuantized})
    CHECK_FALSE(check_addresses(layout, 1, kMaxReferences).has_value());
  CHECK(check_addresses(NodeLayout::kPlanes, 1, kMaxReferences - 8).has_value());
}

TEST_CASE("offsets in a file are 64-bit products") {
  const std::uint64_t many = 0xffffffffu;
  const auto refused = check_addresses(NodeLayout::kPlanes, many, many);
  REQUIRE_FALSE(refused.has_value());
  // 384 bytes of header and table, nodes of 128 bytes, 64 after every 64 of them, 64 up to a multiple of 128, leaves of
  // 64.
  CHECK_THAT(refused.error().message, Contains(std::to_string(384 + many * (128 + 64) + many / 64 * 64 + 64)));
  MemoryLedger ledger;
  ledger.add(many);
  ledger.add(many);
  CHECK(ledger.peak() == 2 * many);
}

TEST_CASE("LBVH joins the last two of the largest possible number of leaves") {
  constexpr auto kLeaves = static_cast<std::uint32_t>(kMaxReferences);
  Sparse<LinkedNode> nodes(kLeaves);
  Sparse<std::uint32_t> counts(kLeaves), met(kLeaves), parents(2 * std::size_t{kLeaves});
  Sparse<std::uint8_t> levels(kLeaves);
  Sparse<Box> boxes(kLeaves);
  if (!all_there(nodes, counts, met, parents, levels, boxes)) return;
  boxes[kLeaves - 2] = box_at({1, 2, 3}, {1, 1, 1});
  boxes[kLeaves - 1] = box_at({2, 3, 4}, {1, 1, 1});
  levels[kLeaves - 3] = 5, levels[kLeaves - 2] = 1;
  met[kLeaves - 3] = met[kLeaves - 2] = kInvalidId;
  LinkedRef root = kInvalidId;
  using Tree = LinkedTree<BoxLeaves>;
  const Tree tree{{&boxes[0]}, &nodes[0], {&counts[0]}, &root};
  const LbvhStep<Tree> step{tree, kLeaves, &levels[0], &met[0]};
  for (const std::uint32_t leaf : {kLeaves - 1, kLeaves - 2}) step(leaf);
  const LinkedNode& last = nodes[kLeaves - 1];
  CHECK(last.child[0] == ((kLeaves - 2) | kLinkedLeaf));
  CHECK(last.child[1] == ((kLeaves - 1) | kLinkedLeaf));
  CHECK(same(last.box, box_at({1, 2, 3}, {2, 2, 2})));
  CHECK(counts[kLeaves - 1] == 2);
  CHECK(root == kInvalidId);
  // Subtrees are numbered behind each other: inner nodes, then leaves.
  const ParentedTree<Tree> parented{tree, kLeaves, &parents[0]};
  CHECK(subtree(parented, kLeaves - 1) == kLeaves - 1);
  CHECK(subtree(parented, kLeaves) == kLinkedLeaf);
  CHECK(subtree(parented, 2 * kLeaves - 1) == ((kLeaves - 1) | kLinkedLeaf));
  const ReinsertionPath<Tree> path{parented, (kLeaves - 1) | kLinkedLeaf, {}};
  CHECK(path.number((kLeaves - 1) | kLinkedLeaf) == 2 * kLeaves - 1);
}

TEST_CASE("equal codes have levels below all others, at every index") {
  for (const std::uint32_t index : {0u, 1u, (1u << 29) - 1, (1u << 31) - 2, (1u << 31) - 1})
    CHECK(boundary_level(7, 7, index) < 32);
  CHECK(boundary_level(6, 7, 0) == 32);
  CHECK(boundary_level(0, std::uint64_t{1} << 62, 0) == 94);
}
