#include <hiprt_build/builders/embree.h>
#include <hiprt_build/steps/clip.h>

#include <embree3/rtcore.h>

#include <memory>

namespace hiprt::build {
namespace {

static_assert(sizeof(Reference) == sizeof(RTCBuildPrimitive) &&
              offsetof(Reference, leaf) == offsetof(RTCBuildPrimitive, primID));

/// Room for references that spatial splits add, relative to those there are.
constexpr double kSplitBudget = 1.5;

/// Node of the tree while Embree makes it: inner (two children) or a leaf with references.
struct EmbreeNode {
  EmbreeNode* child[2];
  Reference* references;
  std::size_t count;  ///< References below.
};

struct Context {
  Monitor& monitor;
  const TriangleSoup& soup;
  std::span<const TriangleGroup> groups;
};

void* create_node(RTCThreadLocalAllocator allocator, unsigned, void*) {
  void* memory = rtcThreadLocalAlloc(allocator, sizeof(EmbreeNode), alignof(EmbreeNode));
  return new (memory) EmbreeNode{};
}

void set_children(void* node, void** children, unsigned count, void*) {
  for (unsigned i = 0; i < count && i < 2; ++i)
    static_cast<EmbreeNode*>(node)->child[i] = static_cast<EmbreeNode*>(children[i]);
}

/// Bounds are made again from the references.
void set_bounds(void*, const RTCBounds**, unsigned, void*) {}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
  auto* node = new (rtcThreadLocalAlloc(allocator, sizeof(EmbreeNode), alignof(EmbreeNode))) EmbreeNode{};
  node->references =
      static_cast<Reference*>(rtcThreadLocalAlloc(allocator, count * sizeof(Reference), alignof(Reference)));
  node->count = count;
  for (std::size_t i = 0; i < count; ++i) {
    const RTCBuildPrimitive& p = primitives[i];
    node->references[i] = Reference{{p.lower_x, p.lower_y, p.lower_z}, 0, {p.upper_x, p.upper_y, p.upper_z}, p.primID};
  }
  return node;
}

void store(const Aabb& box, RTCBounds* bounds) {
  *bounds = RTCBounds{box.min[0], box.min[1], box.min[2], 0, box.max[0], box.max[1], box.max[2], 0};
}

void split_primitive(const RTCBuildPrimitive* primitive, unsigned axis, float plane, RTCBounds* left, RTCBounds* right,
                     void* user) {
  const auto& context = *static_cast<const Context*>(user);
  const Aabb box{Float4{primitive->lower_x, primitive->lower_y, primitive->lower_z, 0},
                 Float4{primitive->upper_x, primitive->upper_y, primitive->upper_z, 0}};
  const SplitBounds bounds = split_bounds(context.soup, context.groups[primitive->primID], box, axis, plane);
  store(bounds.left, left);
  store(bounds.right, right);
}

bool on_progress(void* user, double) {
  try {
    static_cast<Context*>(user)->monitor.check();
  } catch (const Cancelled&) {
    return false;
  }
  return true;
}

RTCBuildQuality quality(Builder builder) {
  return builder == Builder::kEmbreeLow    ? RTC_BUILD_QUALITY_LOW
         : builder == Builder::kEmbreeHigh ? RTC_BUILD_QUALITY_HIGH
                                           : RTC_BUILD_QUALITY_MEDIUM;
}

/// Embree's tree as ours.
class Converter {
 public:
  explicit Converter(BinaryTree& tree) : tree_(tree) {}

  static std::size_t count(EmbreeNode* node) {
    if (node->references == nullptr) node->count = count(node->child[0]) + count(node->child[1]);
    return node->count;
  }

  Aabb convert(const EmbreeNode* node, std::uint32_t at, std::uint32_t first) {
    if (node->references != nullptr) return convert_leaf(node->references, node->count, at, first);
    const auto left_count = static_cast<std::uint32_t>(node->child[0]->count);
    Aabb box = convert(node->child[0], at + 1, first);
    box.add(convert(node->child[1], at + 2 * left_count, first + left_count));
    tree_.nodes[at] = make_node(box, first, static_cast<std::uint32_t>(node->count));
    return box;
  }

 private:
  /// A leaf of several references is halved by count.
  Aabb convert_leaf(const Reference* references, std::size_t count, std::uint32_t at, std::uint32_t first) {
    Aabb box;
    if (count == 1) {
      tree_.references[first] = references[0];
      box = references[0].box();
    } else {
      const auto half = static_cast<std::uint32_t>(count / 2);
      box = convert_leaf(references, half, at + 1, first);
      box.add(convert_leaf(references + half, count - half, at + 2 * half, first + half));
    }
    tree_.nodes[at] = make_node(box, first, static_cast<std::uint32_t>(count));
    return box;
  }

  BinaryTree& tree_;
};

RTCBuildArguments make_arguments(Builder builder, RTCBVH bvh, ScratchArray<Reference>& room, std::size_t count,
                                 Context& context) {
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = quality(builder);
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = kMaxDepth;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = 1;
  arguments.bvh = bvh;
  arguments.primitives = reinterpret_cast<RTCBuildPrimitive*>(room.data());
  arguments.primitiveCount = count;
  arguments.primitiveArrayCapacity = room.size();
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  arguments.splitPrimitive = builder == Builder::kEmbreeHigh ? split_primitive : nullptr;
  arguments.buildProgress = on_progress;
  arguments.userPtr = &context;
  return arguments;
}

/// Embree asks before each of its allocations; what it holds is part of the build's peak.
bool on_memory(void* user, ssize_t bytes, bool) {
  static_cast<std::atomic<std::int64_t>*>(user)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

}  // namespace

Result<BinaryTree> build_embree(CpuEngine& engine, Builder builder, const TriangleSoup& soup,
                                const GroupedTriangles& grouped, ScratchArray<Reference> references) {
  BinaryTree tree;
  const std::size_t count = references.size();
  if (count == 0) return tree;
  engine.monitor().start("split", 0.75, count);
  std::atomic<std::int64_t> embree_bytes{0};
  const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), &rtcReleaseDevice);
  if (device == nullptr)
    return tl::unexpected(Error{ErrorCode::kBackend, "Embree: no device (rtcNewDevice error " +
                                                         std::to_string(rtcGetDeviceError(nullptr)) + ")"});
  rtcSetDeviceMemoryMonitorFunction(device.get(), on_memory, &embree_bytes);
  const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> bvh(rtcNewBVH(device.get()), &rtcReleaseBVH);
  ScratchArray<Reference> room = std::move(references);
  if (builder == Builder::kEmbreeHigh) {
    auto larger = engine.allocate<Reference>(static_cast<std::size_t>(static_cast<double>(count) * kSplitBudget));
    std::copy_n(room.data(), count, larger.data());
    room = std::move(larger);
  }
  Context context{engine.monitor(), soup, grouped.groups.span().first(grouped.count)};
  const RTCBuildArguments arguments = make_arguments(builder, bvh.get(), room, count, context);
  auto* root = static_cast<EmbreeNode*>(rtcBuildBVH(&arguments));
  if (engine.monitor().cancelled()) throw Cancelled{};
  if (root == nullptr)
    return tl::unexpected(Error{ErrorCode::kBackend, "Embree: rtcBuildBVH failed for " + std::to_string(count) +
                                                         " references (error " +
                                                         std::to_string(rtcGetDeviceError(device.get())) + ")"});
  room.release();
  engine.ledger().add(static_cast<std::uint64_t>(embree_bytes.load()));
  const std::size_t total = Converter::count(root);
  tree.references = engine.allocate<Reference>(total);
  tree.nodes = engine.allocate<BinaryNode>(2 * total - 1);
  Converter(tree).convert(root, 0, 0);
  engine.ledger().subtract(static_cast<std::uint64_t>(embree_bytes.load()));
  return tree;
}

}  // namespace hiprt::build
