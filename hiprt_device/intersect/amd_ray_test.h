#pragma once
/// Box and triangle tests with the ray instruction of AMD's RDNA GPUs (image_bvh_intersect_ray). They are policies for
/// scenes of layouts float and half. RDNA4 (gfx120x) has the instruction too, but nobody has verified the bits of its
/// descriptor there. Its own instructions read nodes of another layout (docs/decisions/0022-rdna4-instructions.md).
///
///     __global__ void trace(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits) {
///       if constexpr (hiprt::kHasRayInstruction)  // for sources that are compiled for other GPUs too
///         hits[threadIdx.x] = hiprt::closest_hit<hiprt::HardwarePolicies>(scene, rays[threadIdx.x]);
///     }
///
/// hiprt_device.h includes this header for every processor. Sources for many GPUs read kHasRayInstruction also where
/// it is false, and templates that are not used cost nothing. docs/decisions/0008-amd-ray-instruction.md says what is
/// guaranteed, and under which assumption.

#include <hiprt_device/format/widened_boxes.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/scene_view.h>

/// 1 while the compiler generates code for a GPU that has the instruction: gfx103x, gfx110x, gfx115x, gfx120x.
#if defined(__gfx1030__) || defined(__gfx1031__) || defined(__gfx1032__) || defined(__gfx1033__) || \
    defined(__gfx1034__) || defined(__gfx1035__) || defined(__gfx1036__) || defined(__gfx1100__) || \
    defined(__gfx1101__) || defined(__gfx1102__) || defined(__gfx1103__) || defined(__gfx1150__) || \
    defined(__gfx1151__) || defined(__gfx1152__) || defined(__gfx1153__) || defined(__gfx1200__) || \
    defined(__gfx1201__)
#define HIPRT_HAS_RAY_INSTRUCTION HIPRT_DEVICE_CODE
#else
#define HIPRT_HAS_RAY_INSTRUCTION 0
#endif

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Whether the code that is being compiled may use the policies of this file.
///
/// The value differs between the passes over one source. Use it for `if constexpr` in kernels. Never use it in a
/// template argument of a kernel, whose name it would change.
inline constexpr bool kHasRayInstruction = HIPRT_HAS_RAY_INSTRUCTION != 0;

/// Whether closest_hit(scene, ray) and any_hit(scene, ray) use it in files with widened boxes.
#if defined(__gfx1200__) || defined(__gfx1201__)
inline constexpr bool kUsesRayInstruction = false;
#else
inline constexpr bool kUsesRayInstruction = kHasRayInstruction;
#endif

namespace ray_instruction_detail {

/// hipcc compiles kernels in its host pass too, where nothing calls them.
#if HIPRT_GPU_COMPILER && !HIPRT_DEVICE_CODE
inline constexpr bool kMayBeNamed = true;
#else
inline constexpr bool kMayBeNamed = kHasRayInstruction;
#endif

/// The 128-bit resource of the instruction: which memory it reads, and how.
struct Descriptor {
  std::uint32_t word[4];

  /// Pointers count from base.
  /// @param base multiple of 256; nullptr: pointers are addresses.
  /// @param units size in units of 64 bytes; 0: everything behind base.
  HIPRT_HD HIPRT_FORCE_INLINE Descriptor(const std::byte* base, std::uint64_t units) {
    constexpr std::uint64_t kSizeMask = (std::uint64_t{1} << 42) - 1;
    constexpr std::uint32_t kSort = 1u << 31, kBarycentrics = 1u << 24, kRayResource = 8u << 28;
    const std::uint64_t last = (units - 1) & kSizeMask;
    word[0] = first_word(base);
    word[1] = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(base) >> 40) | kBoxGrowth << 23 | kSort;
    word[2] = static_cast<std::uint32_t>(last);
    word[3] = static_cast<std::uint32_t>(last >> 32) | kBarycentrics | kRayResource;
  }
  HIPRT_HD HIPRT_FORCE_INLINE static std::uint32_t first_word(const std::byte* base) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(base) >> 8);
  }

 private:
  /// Units in the last place by which a box's exit distance grows. Both distances of an interval have the error of two
  /// roundings and a reciprocal. GPURT and HIPRT use the same value.
  static constexpr std::uint32_t kBoxGrowth = 6;
};

#if HIPRT_HAS_RAY_INSTRUCTION

using Float4 = float __attribute__((ext_vector_type(4)));
using Word4 = std::uint32_t __attribute__((ext_vector_type(4)));

template <class Lanes> HIPRT_HD HIPRT_FORCE_INLINE Float4 inverse_direction(const RaySlabs<Lanes>& slabs) {
  return {Lanes::value(slabs.rcp[0]), Lanes::value(slabs.rcp[1]), Lanes::value(slabs.rcp[2]), 0.0f};
}

/// For operands in scalar registers. Without this the compiler emits a loop over the values of the lanes.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t same_in_wave(std::uint32_t value) {
  return static_cast<std::uint32_t>(__builtin_amdgcn_readfirstlane(static_cast<int>(value)));
}
HIPRT_HD HIPRT_FORCE_INLINE Word4 resource(const Descriptor& descriptor) {
  return {same_in_wave(descriptor.word[0]), same_in_wave(descriptor.word[1]), same_in_wave(descriptor.word[2]),
          same_in_wave(descriptor.word[3])};
}

/// @param node in the memory that the descriptor describes.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE Words intersect(const Descriptor& descriptor, NodeRef node, const Vec3& origin,
                                            const Vec3& direction, const RaySlabs<Lanes>& slabs, float extent) {
  const Word4 result = __builtin_amdgcn_image_bvh_intersect_ray(
      node, extent, Float4{origin.x, origin.y, origin.z, 0.0f}, Float4{direction.x, direction.y, direction.z, 0.0f},
      inverse_direction(slabs), resource(descriptor));
  return {{result.x, result.y, result.z, result.w}};
}

/// @param pointer pointer_to() of a node; its address is a multiple of 64.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE Words intersect_at(std::uint64_t pointer, const Vec3& origin, const Vec3& direction,
                                               const RaySlabs<Lanes>& slabs, float extent) {
  const Descriptor descriptor(nullptr, 0);
  const Word4 result = __builtin_amdgcn_image_bvh_intersect_ray_l(
      pointer, extent, Float4{origin.x, origin.y, origin.z, 0.0f}, Float4{direction.x, direction.y, direction.z, 0.0f},
      inverse_direction(slabs), resource(descriptor));
  return {{result.x, result.y, result.z, result.w}};
}

#else

HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t same_in_wave(std::uint32_t value) { return value; }
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE Words intersect(const Descriptor&, NodeRef, const Vec3&, const Vec3&,
                                            const RaySlabs<Lanes>&, float) {
  __builtin_trap();
}
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE Words intersect_at(std::uint64_t, const Vec3&, const Vec3&, const RaySlabs<Lanes>&, float) {
  __builtin_trap();
}

#endif

/// The instruction's pointer: the address in units of 8 bytes, with the node's type in the low bits as in a NodeRef.
HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t pointer_to(const void* address) {
  return reinterpret_cast<std::uintptr_t>(address) >> 3;
}

/// Keeps the compiler from computing or loading earlier what needs the value, or what follows.
HIPRT_HD HIPRT_FORCE_INLINE void hide([[maybe_unused]] float& value) {
#if HIPRT_HAS_RAY_INSTRUCTION
  asm volatile("" : "+v"(value) : : "memory");
#endif
}

template <class Lanes> HIPRT_HD constexpr void require_instruction() {
  static_assert(
      Lanes::kScalar && kMayBeNamed,
      "hiprt: HardwareBoxes and HardwareTriangle need the ray instruction of gfx103x, gfx11xx or gfx120x, and this "
      "code is compiled for another processor; see kHasRayInstruction");
}

}  // namespace ray_instruction_detail

/// Layouts whose box nodes the instruction can read.
template <class Layout>
concept RayInstructionLayout = Layout::kId == NodeLayout::kFloat || Layout::kId == NodeLayout::kHalf;

namespace ray_instruction_detail {

/// As Layout::box(). A GPU widens a half by one instruction, Layout::box() by about forty with branches.
template <class Layout> HIPRT_HD HIPRT_FORCE_INLINE Box stored_box(const typename Layout::Node& node, unsigned child) {
  if constexpr (Layout::kId == NodeLayout::kHalf) {
    const auto& half = node.box[child];
    return {{widen_half(half.min[0]), widen_half(half.min[1]), widen_half(half.min[2])},
            {widen_half(half.max[0]), widen_half(half.max[1]), widen_half(half.max[2])}};
  } else {
    return Layout::box(node, child);
  }
}

/// Conservative::margin() of a ray whose boxes are tested by slabs. It is computed at each node. Computed before the
/// traversal it would occupy a register for all rays.
HIPRT_HD HIPRT_FORCE_INLINE float margin_at_node(Vec3 origin, Box bounds) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    hide(origin[static_cast<int>(axis)]);
    hide(bounds.min[axis]);
    hide(bounds.max[axis]);
  }
  return Conservative::margin(origin, bounds);
}

}  // namespace ray_instruction_detail

/// A box test in software that returns what the instruction returns, for rays that the file's margin is too small for.
/// These are rare, so it saves registers: it keeps no offsets and loads one box after the other.
template <class Layout, class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE SortedChildren sorted_by_slabs(const SceneView& scene, NodeRef ref, const Ray& ray,
                                                           const RaySlabs<Lanes>& slabs, float limit) {
  const float margin = ray_instruction_detail::margin_at_node(ray.origin, scene.bounds);
  const auto& node = *reinterpret_cast<const typename Layout::Node*>(scene.base + ref_offset(ref));
  SortedChildren sorted{};
  float enter[kBranching];
  for (unsigned i = 0; i < kBranching; ++i) {
    const Box box = ray_instruction_detail::stored_box<Layout>(node, i);
    float first = 0.0f, last = limit;
    for (unsigned axis = 0; axis < 3; ++axis) {
      // (p - o -+ margin) / d has the rounding of docs/proofs/ray-instruction.md, By slabs.
      const float rcp = Lanes::value(slabs.rcp[axis]), from = ray.origin[static_cast<int>(axis)];
      const float low = (box.min[axis] - from - margin) * rcp, high = (box.max[axis] - from + margin) * rcp;
      const bool down = slabs.is_down(axis);
      first = max_of(first, down ? high : low);
      const float leave = down ? low : high;
      last = leave < last ? leave : last;
    }
    const NodeRef child = node.child[i];
    const bool met = child != kInvalidRef && first <= last;
    sorted.child[i] = met ? child : kInvalidRef;
    enter[i] = met ? first : std::numeric_limits<float>::infinity();
    ray_instruction_detail::hide(enter[i]);
  }
  const auto sort = [&](unsigned a, unsigned b) HIPRT_FORCE_INLINE_LAMBDA {
    const bool swap = enter[b] < enter[a];
    const float near = swap ? enter[b] : enter[a];
    const NodeRef nearer = choose(swap, sorted.child[b], sorted.child[a]);
    enter[b] = swap ? enter[a] : enter[b];
    sorted.child[b] = choose(swap, sorted.child[a], sorted.child[b]);
    enter[a] = near;
    sorted.child[a] = nearer;
  };
  sort(0, 2);
  sort(1, 3);
  sort(0, 1);
  sort(2, 3);
  sort(1, 2);
  return sorted;
}

/// Box test policy: the ray instruction.
///
/// It sorts a node's children by distance but does not return the distances. So the stack cannot drop nodes that a
/// nearer hit has put out of reach. Boxes of custom primitives are tested as by Conservative.
///
/// In files with widened boxes (build::BuildOptions::widen_boxes) it hides no hit. This holds under an assumption about
/// the instruction's rounding (docs/proofs/ray-instruction.md). Rays that start too far away for the file's margin are
/// tested by slabs in software. So are all rays in files without widened boxes.
/// @tparam kOneScene whether all lanes of a wave trace the same scene. That saves two instructions per node.
template <bool kOneScene> struct BasicHardwareBoxes : Conservative {
  struct Choice {
    /// All bits: the ray needs the test in software. 0: it does not.
    std::uint32_t rare;
    /// The descriptor's first word, if kOneScene. The compiler cannot tell that it is the same for all nodes and lanes.
    std::uint32_t first_word = 0;

    HIPRT_HD HIPRT_FORCE_INLINE Choice(const SceneView& scene, const Vec3& origin) {
      const Extents of(origin, scene.bounds);
      // A NaN chooses the slabs.
      rare = needed_box_margin(of.reach, of.magnitude + max_component(origin)) <= scene.box_margin ? 0u : ~0u;
      using namespace ray_instruction_detail;
      if constexpr (kOneScene) first_word = same_in_wave(Descriptor::first_word(scene.base));
    }
  };

  /// @param scene at an address that is a multiple of 256.
  /// @param limit hits beyond it do not count. Boxes before tmin are visited, because the instruction has no tmin.
  template <RayInstructionLayout Layout, class Lanes>
  HIPRT_HD static HIPRT_FORCE_INLINE SortedChildren intersect(const SceneView& scene, NodeRef node, const Ray& ray,
                                                              const RaySlabs<Lanes>& slabs, const Choice& choice,
                                                              float limit) {
    SortedChildren sorted = intersect_usual<Layout>(scene, node, ray, slabs, choice, limit);
    if (choice.rare != 0) [[unlikely]]
      sorted = sorted_by_slabs<Layout>(scene, node, ray, slabs, limit);
    return sorted;
  }

  /// intersect() for rays with choice.rare == 0. See HasUsualStep.
  template <RayInstructionLayout Layout, class Lanes>
  HIPRT_HD static HIPRT_FORCE_INLINE SortedChildren intersect_usual(const SceneView& scene, NodeRef node,
                                                                    const Ray& ray, const RaySlabs<Lanes>& slabs,
                                                                    const Choice& choice, float limit) {
    using namespace ray_instruction_detail;
    require_instruction<Lanes>();
    Words met;
    if constexpr (kOneScene) {
      Descriptor descriptor(scene.base, scene.size / kNodeGranularity);
      descriptor.word[0] = choice.first_word;
      met = ray_instruction_detail::intersect(descriptor, node, ray.origin, ray.direction, slabs, limit);
    } else {
      met = intersect_at(pointer_to(scene.base) + node, ray.origin, ray.direction, slabs, limit);
    }
    return {{met.word[0], met.word[1], met.word[2], met.word[3]}};
  }
};

/// For kernels in which all lanes of a wave trace the same scene.
using HardwareBoxes = BasicHardwareBoxes<true>;

/// Triangle test policy: the ray instruction.
///
/// Its rounding is not published. So there is no guarantee that rays do not pass between neighbours, and Hit::error is
/// no bound of its errors.
struct HardwareTriangle {
  template <class Lanes> struct PreparedRay {
    Vec3 origin, direction;
    RaySlabs<Lanes> slabs;  ///< For the inverse direction.
    HIPRT_HD HIPRT_FORCE_INLINE explicit PreparedRay(const Ray& ray)
        : origin(ray.origin), direction(ray.direction), slabs(ray, 0.0f) {}
  };

  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    static_assert(std::same_as<Leaf, FloatLeaf>, "hiprt: HardwareTriangle needs layout float or half");
    ray_instruction_detail::require_instruction<Lanes>();
    constexpr float kMax = std::numeric_limits<float>::max();
    const unsigned count = info.primitive[1] == kInvalidId ? 1 : 2;
    for (unsigned triangle = 0; triangle < count; ++triangle) {
      const auto type = static_cast<NodeType>(static_cast<std::uint32_t>(NodeType::kTriangle0) + triangle);
      const std::uint64_t pointer = ray_instruction_detail::pointer_to(&leaf) | static_cast<std::uint64_t>(type);
      const Words met = ray_instruction_detail::intersect_at(pointer, ray.origin, ray.direction, ray.slabs, kMax);
      // Distance and weights are numerators; the sign of their denominator is the side. A miss has t = +inf.
      const float denominator = met.as_float(1), t = met.as_float(0) / denominator;
      const float scale = 1.0f / denominator;
      if (!(absolute(t) <= kMax)) continue;
      if (!accept(Candidate{t, met.as_float(2) * scale, met.as_float(3) * scale, faces(leaf, triangle, ray.direction)},
                  triangle))
        return false;
    }
    return true;
  }

 private:
  /// Whether a line in this direction meets the triangle's front, as far as float tells.
  HIPRT_HD static HIPRT_FORCE_INLINE bool faces(const FloatLeaf& leaf, unsigned triangle, const Vec3& direction) {
    const auto corner = [&](unsigned k) {
      const float(&v)[3] = leaf.vertex[corner_vertex(triangle, k)];
      return Vec3(v[0], v[1], v[2]);
    };
    const Vec3 edge1 = corner(1) - corner(0), edge2 = corner(2) - corner(0);
    const float x = edge1.y * edge2.z - edge1.z * edge2.y, y = edge1.z * edge2.x - edge1.x * edge2.z,
                z = edge1.x * edge2.y - edge1.y * edge2.x;
    return x * direction.x + y * direction.y + z * direction.z < 0.0f;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
