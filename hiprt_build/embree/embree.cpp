#include <hiprt_build/embree/embree.h>
#include <hiprt_build/embree/rtcore.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/presplit/clip.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>

#include <cmath>
#include <memory>

namespace hiprt::build {
namespace {

/// Node of the tree while Embree makes it: inner (two children) or a leaf.
struct EmbreeNode {
  EmbreeNode* child[2];
  RTCBuildPrimitive* primitives;  ///< Of a leaf: references by their numbers (primID), in Embree's scale.
  std::size_t count;              ///< References below.
};

SimdBox box_of(const RTCBuildPrimitive& p) {
  return SimdBox{Float4{p.lower_x, p.lower_y, p.lower_z, 0}, Float4{p.upper_x, p.upper_y, p.upper_z, 0}};
}

/// Embree's binning overflows (in an assert) on coordinates beyond about 2^62, and areas underflow below 2^-74. It is
/// given coordinates times a power of two instead, which is 1 for common scenes.
struct Scaling {
  float factor = 1.0f, inverse = 1.0f;

  Scaling(CpuEngine& engine, std::span<const Reference> references) {
    constexpr int kSmallest = -20, kLargest = 40, kMostUp = 126;
    const SimdBox all = bound_references(engine, references).box;
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
  SimdBox apply(const SimdBox& box) const {
    SimdBox scaled{box.min * factor, box.max * factor};
    if (factor < 1.0f)
      for (int axis = 0; axis < 3; ++axis) {
        if (scaled.min[axis] * inverse > box.min[axis])
          scaled.min[axis] = std::nextafter(scaled.min[axis], -SimdBox::kInfinity);
        if (scaled.max[axis] * inverse < box.max[axis])
          scaled.max[axis] = std::nextafter(scaled.max[axis], SimdBox::kInfinity);
      }
    return scaled;
  }
  SimdBox undo(const SimdBox& box) const { return SimdBox{box.min * inverse, box.max * inverse}; }
};

struct Context {
  Monitor& monitor;
  const GeometryTable& geometries;
  std::span<const Reference> references;
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
  node->primitives = static_cast<RTCBuildPrimitive*>(
      rtcThreadLocalAlloc(allocator, count * sizeof(RTCBuildPrimitive), alignof(RTCBuildPrimitive)));
  node->count = count;
  std::copy_n(primitives, count, node->primitives);
  return node;
}

void store(const SimdBox& box, RTCBounds* bounds) {
  *bounds = RTCBounds{box.min[0], box.min[1], box.min[2], 0, box.max[0], box.max[1], box.max[2], 0};
}

void split_primitive(const RTCBuildPrimitive* primitive, unsigned axis, float plane, RTCBounds* left, RTCBounds* right,
                     void* user) {
  const auto& context = *static_cast<const Context*>(user);
  // While it splits, Embree does not ask on_progress(); an exception ends its build as its own errors do.
  context.monitor.check();
  const Scaling& scaling = context.scaling;
  const SplitBounds bounds = split_bounds(context.geometries, context.references[primitive->primID],
                                          scaling.undo(box_of(*primitive)), axis, plane * scaling.inverse);
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
  Converter(DepthFirstTree& tree, const Context& context) : tree_(tree), context_(context) {}

  static std::size_t count(EmbreeNode* node, Monitor& monitor) {
    constexpr std::size_t kMany = 4096;
    if (node->primitives == nullptr) {
      node->count = count(node->child[0], monitor) + count(node->child[1], monitor);
      if (node->count > kMany) monitor.check();
    }
    return node->count;
  }

  SimdBox convert(const EmbreeNode* node, std::uint32_t at, std::uint32_t first) {
    if (node->primitives != nullptr) return convert_leaf(node->primitives, node->count, at, first);
    const auto left_count = static_cast<std::uint32_t>(node->child[0]->count);
    SimdBox box = convert(node->child[0], at + 1, first);
    box.add(convert(node->child[1], at + 2 * left_count, first + left_count));
    tree_.nodes[at] = {to_box(box), first, static_cast<std::uint32_t>(node->count)};
    return box;
  }

 private:
  /// A leaf of several references is halved by count.
  SimdBox convert_leaf(const RTCBuildPrimitive* primitives, std::size_t count, std::uint32_t at, std::uint32_t first) {
    SimdBox box;
    if (count == 1) {
      box = context_.scaling.undo(box_of(primitives[0]));
      context_.monitor.add(1);
      tree_.references[first] = part_of(context_.references[primitives[0].primID], to_box(box));
    } else {
      const auto half = static_cast<std::uint32_t>(count / 2);
      box = convert_leaf(primitives, half, at + 1, first);
      box.add(convert_leaf(primitives + half, count - half, at + 2 * half, first + half));
    }
    tree_.nodes[at] = {to_box(box), first, static_cast<std::uint32_t>(count)};
    return box;
  }

  DepthFirstTree& tree_;
  const Context& context_;
};

/// The references as Embree takes them. @param capacity with space for splits.
ScratchArray<RTCBuildPrimitive> make_primitives(CpuEngine& engine, const Context& context, std::size_t capacity) {
  auto primitives = engine.allocate<RTCBuildPrimitive>(capacity);
  engine.for_quiet_chunks(context.references.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SimdBox box = context.scaling.apply(simd_box(context.references[i]));
      primitives[i] = {box.min[0], box.min[1], box.min[2], 0,
                       box.max[0], box.max[1], box.max[2], static_cast<std::uint32_t>(i)};
    }
  });
  return primitives;
}

RTCBuildArguments make_arguments(Builder builder, RTCBVH bvh, ScratchArray<RTCBuildPrimitive>& primitives,
                                 std::size_t count, const Context& context) {
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = quality(builder);
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = kMaxDepth;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = 1;
  arguments.bvh = bvh;
  arguments.primitives = primitives.data();
  arguments.primitiveCount = count;
  arguments.primitiveArrayCapacity = primitives.size();
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

const char* embree_version() { return RTC_VERSION_STRING; }

Result<DepthFirstTree> build_embree(CpuEngine& engine, Builder builder, const GeometryTable& geometries,
                                    ScratchArray<Reference> references, double split_budget) {
  DepthFirstTree tree;
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
  const Context context{engine.monitor(), geometries, references.span(), Scaling(engine, references.span())};
  auto primitives =
      make_primitives(engine, context, builder == Builder::kEmbreeHigh ? split_capacity(count, split_budget) : count);
  const RTCBuildArguments arguments = make_arguments(builder, bvh.get(), primitives, count, context);
  auto* root = static_cast<EmbreeNode*>(rtcBuildBVH(&arguments));
  if (engine.monitor().cancelled()) throw Cancelled{};
  if (root == nullptr)
    return tl::unexpected(Error{ErrorCode::kBackend,
                                "Embree: rtcBuildBVH failed for " + std::to_string(count) + " references: " + message});
  primitives.release();
  engine.ledger().add(static_cast<std::uint64_t>(embree_bytes.load()));
  const std::size_t total = Converter::count(root, engine.monitor());
  engine.monitor().start("convert", 0.8, total);
  tree.references = engine.allocate<Reference>(total);
  tree.nodes = engine.allocate<DepthFirstNode>(2 * total - 1);
  Converter(tree, context).convert(root, 0, 0);
  engine.ledger().subtract(static_cast<std::uint64_t>(embree_bytes.load()));
  return tree;
}

}  // namespace hiprt::build
