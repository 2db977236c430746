#pragma once
/// The policies of HIPRT's traversal classes. Internal.

#include <hiprt/impl/user_stack.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// Hits have HIPRT's normals (surface.h), so the queries compute none.
struct BasePolicies : Policies {
#if HIPRT_GPU_COMPILER
  using Schedule = Postponed;
#endif
  static constexpr bool kSurface = false;
  static constexpr bool kViewInMemory = true;  // A handle is its address.
};

/// The private stack of this library: it has room for every tree of the builders.
template <class Named> struct StackPolicies : BasePolicies {};
/// A program's own stack has entries of 32 bits, so its entries have no distances.
template <class Own>
requires(!kIsNamedStack<Own>) struct StackPolicies<Own> : BasePolicies {
  using Stack = UserStack<Own>;
  using ClosestOrder = NearFirstReferences;
};

/// For one geometry of triangles. Custom primitives need registers, so there is no code for them.
template <class Stack> struct TrianglePolicies : StackPolicies<Stack> {
  static constexpr FeatureMask kFeatures = kKnownFeatures & ~feature_bit(Feature::kCustom);
};
/// For one geometry of any kind.
template <class Stack> struct CustomPolicies : StackPolicies<Stack> {};
/// For scenes.
template <class Stack> struct ScenePolicies : Moving<Instanced<StackPolicies<Stack>, hiprtMaxInstanceLevels>> {};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
