#include <hiprt_build/embree/embree.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/presplit/clip.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>

#include <embree3/rtcore.h>

#include <cmath>
#include <memory>

namespace hiprt::build {
namespace {

static_assert(sizeof(Reference) == sizeof(RTCBuildPrimitive) &&
              offsetof(Reference, leaf) == offsetof(RTCBuildPrimitive, primID));

/// Node of the tree while Embree makes it: inner (two children) or a leaf with references.
struct EmbreeNode {
  EmbreeNode* child[2];
  Reference* references;
  std::size_t count;  ///< References below.
};

/// Embree's binning overflows (in an assert) on coordinates beyond about 2^62, and areas underflow below 2^-74. It is
/// given coordinates times a power of two instead, which is 1 for common scenes.
struct Scaling {
  float factor = 1.0f, inverse = 1.0f;

  Scaling(CpuEngine& engine, std::span<const Reference> references) {
    constexpr int kSmallest = -20, kLargest = 40, kMostUp = 126;
    const Aabb all = bound_references(engine, references).box;
    float largest = 0.0f;
    for (int axis = 0; axis < 3; ++axis)
      largest = std::max({largest, std::abs(all.min[axis]), std::abs(all.max[axis])});
    if (largest == 0.0f) return;
    const int exponent = std::ilogb(largest);
    if (exponent >= kSmallest && exponent <= kLargest) return;
    const int shift = std::min((exponent < kSmallest ? kSmallest : kLargest) - exponent, kMostUp);
    factor = std::ldexp(1.0f, shift);
    inverse = std::ldexp(1.0f, -shift);
  }
  /// Exact, unless the result is subnormal; then one step outwards makes up for the rounding.
  Aabb apply(const Aabb& box) const {
    Aabb scaled{box.min * factor, box.max * factor};
    if (factor < 1.0f)
      for (int axis = 0; axis < 3; ++axis) {
        if (scaled.min[axis] * inverse > box.min[axis])
          scaled.min[axis] = std::nextafter(scaled.min[axis], -Aabb::kInfinity);
        if (scaled.max[axis] * inverse < box.max[axis])
          scaled.max[axis] = std::nextafter(scaled.max[axis], Aabb::kInfinity);
      }
    return scaled;
  }
  Aabb undo(const Aabb& box) const { return Aabb{box.min * inverse, box.max * inverse}; }
  void apply(CpuEngine& engine, std::span<Reference> references) const {
    if (factor == 1.0f) return;
    engine.for_quiet_chunks(references.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
      for (Reference& r : references.subspan(begin, end - begin)) {
        const Aabb box = apply(r.box());
        for (int axis = 0; axis < 3; ++axis) r.min[axis] = box.min[axis], r.max[axis] = box.max[axis];
      }
    });
  }
};

struct Context {
  Monitor& monitor;
  const PrimitiveSoup& soup;
  std::span<const PrimitiveGroup> groups;
  Scaling scaling;
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
  // While it splits, Embree does not ask on_progress(); an exception ends its build as its own errors do.
  context.monitor.check();
  const Aabb box{Float4{primitive->lower_x, primitive->lower_y, primitive->lower_z, 0},
                 Float4{primitive->upper_x, primitive->upper_y, primitive->upper_z, 0}};
  const Scaling& scaling = context.scaling;
  const SplitBounds bounds =
      split_bounds(context.soup, context.groups[primitive->primID], scaling.undo(box), axis, plane * scaling.inverse);
  store(scaling.apply(bounds.left), left);
  store(scaling.apply(bounds.right), right);
}

bool on_progress(void* user, double) {
  try {
    static_cast<const Context*>(user)->monitor.check();
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
  Converter(BinaryTree& tree, const Scaling& scaling, Monitor& monitor)
      : tree_(tree), scaling_(scaling), monitor_(monitor) {}

  static std::size_t count(EmbreeNode* node, Monitor& monitor) {
    constexpr std::size_t kMany = 4096;
    if (node->references == nullptr) {
      node->count = count(node->child[0], monitor) + count(node->child[1], monitor);
      if (node->count > kMany) monitor.check();
    }
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
      box = scaling_.undo(references[0].box());
      monitor_.add(1);
      tree_.references[first] =
          Reference{{box.min[0], box.min[1], box.min[2]}, 0, {box.max[0], box.max[1], box.max[2]}, references[0].leaf};
    } else {
      const auto half = static_cast<std::uint32_t>(count / 2);
      box = convert_leaf(references, half, at + 1, first);
      box.add(convert_leaf(references + half, count - half, at + 2 * half, first + half));
    }
    tree_.nodes[at] = make_node(box, first, static_cast<std::uint32_t>(count));
    return box;
  }

  BinaryTree& tree_;
  const Scaling& scaling_;
  Monitor& monitor_;
};

RTCBuildArguments make_arguments(Builder builder, RTCBVH bvh, ScratchArray<Reference>& room, std::size_t count,
                                 const Context& context) {
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
  arguments.userPtr = const_cast<Context*>(&context);
  return arguments;
}

/// Embree asks before each of its allocations; what it holds is part of the build's peak.
bool on_memory(void* user, ssize_t bytes, bool) {
  static_cast<std::atomic<std::int64_t>*>(user)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

/// Keeps the first message.
void on_error(void* user, RTCError, const char* message) {
  auto& text = *static_cast<std::string*>(user);
  if (text.empty() && message != nullptr) text = message;
}

}  // namespace

Result<BinaryTree> build_embree(CpuEngine& engine, Builder builder, const PrimitiveSoup& soup,
                                const GroupedPrimitives& grouped, ScratchArray<Reference> references,
                                double split_budget) {
  BinaryTree tree;
  const std::size_t count = references.size();
  if (count == 0) return tree;
  engine.monitor().start("split", 0.75, count);
  std::atomic<std::int64_t> embree_bytes{0};
  const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), &rtcReleaseDevice);
  if (device == nullptr)
    return tl::unexpected(Error{ErrorCode::kBackend, "Embree: no device (rtcNewDevice error " +
                                                         std::to_string(rtcGetDeviceError(nullptr)) + ")"});
  std::string message;
  rtcSetDeviceErrorFunction(device.get(), on_error, &message);
  rtcSetDeviceMemoryMonitorFunction(device.get(), on_memory, &embree_bytes);
  const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> bvh(rtcNewBVH(device.get()), &rtcReleaseBVH);
  ScratchArray<Reference> room = std::move(references);
  if (builder == Builder::kEmbreeHigh) {
    auto larger = engine.allocate<Reference>(room_for_splits(count, split_budget));
    engine.copy(std::as_const(room).span(), larger.span());
    room = std::move(larger);
  }
  const Context context{engine.monitor(), soup, grouped.groups.span().first(grouped.count),
                        Scaling(engine, room.span().first(count))};
  context.scaling.apply(engine, room.span().first(count));
  const RTCBuildArguments arguments = make_arguments(builder, bvh.get(), room, count, context);
  auto* root = static_cast<EmbreeNode*>(rtcBuildBVH(&arguments));
  if (engine.monitor().cancelled()) throw Cancelled{};
  if (root == nullptr)
    return tl::unexpected(Error{ErrorCode::kBackend,
                                "Embree: rtcBuildBVH failed for " + std::to_string(count) + " references: " + message});
  room.release();
  engine.ledger().add(static_cast<std::uint64_t>(embree_bytes.load()));
  const std::size_t total = Converter::count(root, engine.monitor());
  engine.monitor().start("convert", 0.8, total);
  tree.references = engine.allocate<Reference>(total);
  tree.nodes = engine.allocate<BinaryNode>(2 * total - 1);
  Converter(tree, context.scaling, engine.monitor()).convert(root, 0, 0);
  engine.ledger().subtract(static_cast<std::uint64_t>(embree_bytes.load()));
  return tree;
}

}  // namespace hiprt::build
