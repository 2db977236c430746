#pragma once
/// HIPRT's traversals over the queries of this library. Internal.

#include <hiprt/impl/functions.h>
#include <hiprt/impl/policies.h>
#include <hiprt_device/query/query_core.h>
#include <hiprt_device/traverse/policy_checks.h>

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// The arguments of a traversal's constructor.
struct Arguments {
  const void* scene;
  hiprtRay ray;
  void* payload;
  hiprtFuncTable table;
  std::uint32_t ray_type;
  std::uint32_t mask = hiprtFullRayMask;
  float time = 0.0f;

  HIPRT_HD HIPRT_FORCE_INLINE Functions functions() const { return {table, payload, ray_type, ray.minT}; }
  /// @tparam kCustom boxes of custom primitives count from t = 0 on, whatever minT is.
  template <bool kCustom> HIPRT_HD HIPRT_FORCE_INLINE Ray query_ray() const {
    return {to_vec3(ray.origin), kCustom ? 0.0f : ray.minT, to_vec3(ray.direction), ray.maxT, mask, time};
  }
};

/// The memory of a traversal: its stack and its paths.
template <class P> class TraversalMemory {
 public:
  template <class Stack> HIPRT_HD HIPRT_FORCE_INLINE typename P::Stack::Storage storage(Stack*) {
    return typename P::Stack::Storage(memory_);
  }

 private:
  typename P::Stack::Memory memory_;
};
/// With the program's own stack.
template <class P>
requires std::is_same_v<typename P::ClosestOrder, NearFirstReferences>
class TraversalMemory<P> {
 public:
  template <class Stack> HIPRT_HD HIPRT_FORCE_INLINE typename P::Stack::Storage storage(Stack* stack) {
    if constexpr (P::kLevels == 0)
      return typename P::Stack::Storage{stack};
    else
      return typename P::Stack::Storage(typename UserStack<Stack>::Storage{stack}, paths_.memory);
  }

 private:
  struct Paths {
    PathMemory<P::kLevels == 0 ? 1 : P::kLevels> memory;
  };
  struct None {};
  std::conditional_t<P::kLevels == 0, None, Paths> paths_;
};

/// The program's stack, if the traversal uses it.
template <class Stack> struct StackPointer {
  Stack* own;
  HIPRT_HD HIPRT_FORCE_INLINE Stack* get() const { return own; }
};
template <class Named>
requires kIsNamedStack<Named>
struct StackPointer<Named> {
  HIPRT_HD HIPRT_FORCE_INLINE Named* get() const { return nullptr; }
};

/// What both kinds of traversals share.
/// @tparam P policies.
/// @tparam Order, kKind as those of HitSearch.
/// @tparam Stack the program's stack class. Stacks of this library are replaced by a private stack.
template <class P, class Order, SearchKind kKind, class Stack> class TraversalBase {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE hiprtTraversalState getCurrentState() const { return state_; }

 protected:
  static constexpr bool kCustom = (P::kFeatures & feature_bit(Feature::kCustom)) != 0;
  using Primitives = std::conditional_t<kCustom, FunctionPrimitives, NoPrimitives>;
  using Filter = FunctionFilter<typename P::Layout>;
  using Search = HitSearch<P, Order, kKind, Filter, Primitives>;

  /// @param others the arguments behind the ray.
  template <class... Others>
  HIPRT_HD HIPRT_FORCE_INLINE TraversalBase([[maybe_unused]] Stack* stack, const void* scene, const hiprtRay& ray,
                                            Others... others)
      : arguments_{scene, ray, others...} {
    if constexpr (!kIsNamedStack<Stack>) {
      stack_.own = stack;
      stack->reset();
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE Search search_in(const SceneView& scene, TraversalMemory<P>& memory) const {
    const Functions functions = arguments_.functions();
    Primitives primitives{};
    if constexpr (kCustom) {
      primitives.functions = functions;
      primitives.least_t = max_of(arguments_.ray.minT, 0.0f);
    }
    return Search(scene, arguments_.template query_ray<kCustom>(), memory.storage(stack_.get()), Filter{functions},
                  primitives, {});
  }
  /// The search's hit, or a miss. Notes the state.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit result_of(const Search& search) {
    const bool overflow = search.state() == TraversalState::kStackOverflow;
    // A closest hit ends the traversal.
    state_ = overflow                                                               ? hiprtTraversalStateStackOverflow
             : kKind == SearchKind::kEach && search.state() == TraversalState::kHit ? hiprtTraversalStateHit
                                                                                    : hiprtTraversalStateFinished;
    const auto hit = search.hit();
    // Scenes give what was found before the overflow.
    if (!hit.found() || (overflow && (kKind == SearchKind::kEach || P::kLevels == 0))) return no_hit();
    // Read again, so that no register keeps the view during the search.
    return to_hiprt<typename P::Layout, kCustom>(view_of(forget(static_cast<const std::byte*>(arguments_.scene))), hit,
                                                 search.leaf());
  }

  Arguments arguments_;
  [[no_unique_address]] StackPointer<Stack> stack_;
  hiprtTraversalState state_ = hiprtTraversalStateInit;
};

/// Finds the closest hit. The query and its stack live in getNextHit() only, so that they can be in registers.
template <class P, class Stack = hiprtPrivateStack>
class ClosestTraversal : public TraversalBase<P, typename P::ClosestOrder, SearchKind::kClosest, Stack> {
 public:
  /// The closest hit; a miss if there is none, and after the first call.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit getNextHit() {
    if (this->state_ != hiprtTraversalStateInit) return no_hit();
    const SceneView& scene = view_of(this->arguments_.scene);
    TraversalMemory<P> memory;
    auto search = this->search_in(scene, memory);
    search.find_closest(false);
    return this->result_of(search);
  }

 protected:
  template <class... All>
  HIPRT_HD HIPRT_FORCE_INLINE explicit ClosestTraversal(Stack* stack, const All&... all)
      : ClosestTraversal::TraversalBase(stack, all...) {}
};

/// Finds one hit per call, in no order.
///
/// Between calls it keeps where the query has stopped. Each call makes the query anew, so that it can be in registers.
template <class P, class Stack = hiprtPrivateStack>
class AnyHitTraversal : public TraversalBase<P, typename P::AnyOrder, SearchKind::kEach, Stack> {
 public:
  AnyHitTraversal(const AnyHitTraversal&) = delete;
  AnyHitTraversal& operator=(const AnyHitTraversal&) = delete;

  /// One more hit; a miss after the last.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit getNextHit() {
    if (this->state_ == hiprtTraversalStateFinished || this->state_ == hiprtTraversalStateStackOverflow)
      return no_hit();
    const SceneView& scene = view_of(this->arguments_.scene);
    // The first call set up the memory. Doing so again writes the same values.
    auto search = this->search_in(scene, memory_);
    if (this->state_ == hiprtTraversalStateHit) search.resume(position_);
    search.find_any(false, &position_);
    return this->result_of(search);
  }

 protected:
  template <class... All>
  HIPRT_HD HIPRT_FORCE_INLINE explicit AnyHitTraversal(Stack* stack, const All&... all)
      : AnyHitTraversal::TraversalBase(stack, all...) {}

 private:
  using Position = typename AnyHitTraversal::TraversalBase::Search::Position;
  static_assert(__is_trivially_copyable(Position));
  TraversalMemory<P> memory_;
  union {
    Position position_;  ///< After a hit.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
