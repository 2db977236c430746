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

  HIPRT_HD HIPRT_FORCE_INLINE Functions functions() const {
    Functions functions;
    if (table != nullptr) functions.header = *static_cast<const hiprtFuncTableHeader*>(table);
    functions.payload = payload;
    functions.ray_type = ray_type;
    functions.min_t = ray.minT;
    functions.has_table = table != nullptr;
    return functions;
  }
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

/// What both kinds of traversals share.
/// @tparam P policies.
/// @tparam Order, kResumable as those of HitSearch.
/// @tparam Stack the program's stack class. Stacks of this library are replaced by a private stack.
template <class P, class Order, bool kResumable, class Stack> class TraversalBase {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE hiprtTraversalState getCurrentState() const { return state_; }

 protected:
  static constexpr bool kCustom = (P::kFeatures & feature_bit(Feature::kCustom)) != 0;
  using Primitives = std::conditional_t<kCustom, FunctionPrimitives, NoPrimitives>;
  using Filter = FunctionFilter<typename P::Layout>;
  using Search = HitSearch<P, Order, kResumable, Filter, Primitives>;

  HIPRT_HD HIPRT_FORCE_INLINE TraversalBase(const Arguments& arguments, Stack* stack)
      : arguments_(arguments), stack_(stack) {
    if constexpr (!kIsNamedStack<Stack>) stack_->reset();
  }

  HIPRT_HD HIPRT_FORCE_INLINE Search search_in(const SceneView& scene, TraversalMemory<P>& memory) const {
    const Functions functions = arguments_.functions();
    Primitives primitives{};
    if constexpr (kCustom) {
      primitives.functions = functions;
      primitives.least_t = max_of(arguments_.ray.minT, 0.0f);
    }
    return Search(scene, arguments_.template query_ray<kCustom>(), memory.storage(stack_), Filter{functions},
                  primitives, {});
  }
  /// The search's hit, or a miss. Notes the state.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit result_of(const Search& search, const SceneView& scene) {
    const bool overflow = search.state() == TraversalState::kStackOverflow;
    // A closest hit ends the traversal.
    state_ = overflow                                               ? hiprtTraversalStateStackOverflow
             : kResumable && search.state() == TraversalState::kHit ? hiprtTraversalStateHit
                                                                    : hiprtTraversalStateFinished;
    const auto hit = search.hit();
    // Scenes give what was found before the overflow.
    if (!hit.found() || (overflow && (kResumable || P::kLevels == 0))) return no_hit();
    return to_hiprt<typename P::Layout>(scene, hit, search.leaf());
  }

  Arguments arguments_;
  Stack* stack_;
  hiprtTraversalState state_ = hiprtTraversalStateInit;
};

/// Finds the closest hit. The query and its stack live in getNextHit() only, so that they can be in registers.
template <class P, class Stack = hiprtPrivateStack>
class ClosestTraversal : public TraversalBase<P, typename P::ClosestOrder, false, Stack> {
 public:
  /// The closest hit; a miss if there is none, and after the first call.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit getNextHit() {
    if (this->state_ != hiprtTraversalStateInit) return no_hit();
    const SceneView scene = view_of(this->arguments_.scene);
    TraversalMemory<P> memory;
    auto search = this->search_in(scene, memory);
    search.find_closest(false);
    return this->result_of(search, scene);
  }

 protected:
  HIPRT_HD HIPRT_FORCE_INLINE ClosestTraversal(const Arguments& arguments, Stack* stack)
      : ClosestTraversal::TraversalBase(arguments, stack) {}
};

/// Finds one hit per call, in no order.
///
/// Between calls the query is kept as bytes. getNextHit() works on a copy, so that it can be in registers.
template <class P, class Stack = hiprtPrivateStack>
class AnyHitTraversal : public TraversalBase<P, typename P::AnyOrder, true, Stack> {
 public:
  AnyHitTraversal(const AnyHitTraversal&) = delete;
  AnyHitTraversal& operator=(const AnyHitTraversal&) = delete;

  /// One more hit; a miss after the last.
  HIPRT_HD HIPRT_FORCE_INLINE hiprtHit getNextHit() {
    if (this->state_ == hiprtTraversalStateFinished || this->state_ == hiprtTraversalStateStackOverflow)
      return no_hit();
    const SceneView scene = view_of(this->arguments_.scene);
    // The first call set up the memory. Doing so again writes the same values.
    auto search = this->search_in(scene, memory_);
    if (this->state_ == hiprtTraversalStateHit) {
      search = saved_;
      search.use(scene);
    }
    search.find_any(false);
    const hiprtHit hit = this->result_of(search, scene);
    if (this->state_ == hiprtTraversalStateHit) saved_ = search;
    return hit;
  }

 protected:
  HIPRT_HD HIPRT_FORCE_INLINE AnyHitTraversal(const Arguments& arguments, Stack* stack)
      : AnyHitTraversal::TraversalBase(arguments, stack) {}

 private:
  static_assert(__is_trivially_copyable(typename AnyHitTraversal::TraversalBase::Search), "a query is kept as bytes");
  TraversalMemory<P> memory_;
  union {
    typename AnyHitTraversal::TraversalBase::Search saved_;  ///< After a hit.
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
