#pragma once
/// A traversal's stack together with the second, small one for scenes of more than one level of instances.

#include <hiprt_device/format/instance.h>
#include <hiprt_device/stack.h>

#include <cstdint>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// An object that a ray is in, and the ray as the object sees it.
template <class Real> struct EnteredObject {
  const ObjectRecord* object;
  Real origin[3], direction[3];
};

/// Three ways through instances: the ray's, the hit's, and that of the hit before; and what is on the ray's way.
/// @tparam Real of the rays.
template <unsigned kLevels, class Real = float> struct LevelWays {
  EnteredObject<Real> entered[kLevels];
  std::uint32_t instance[3 * kLevels];
};

namespace stack_detail {

template <class Stack, unsigned kLevels, class Real> struct LevelMemory { using Type = void; };
template <class Stack, unsigned kLevels, class Real>
requires requires { typename Stack::Memory; }
struct LevelMemory<Stack, kLevels, Real> {
  struct Type {
    typename Stack::Memory stack;
    LevelWays<kLevels, Real> ways;
  };
};

}  // namespace stack_detail

/// Any other stack, and memory for ways through @p kLevels levels. What Instanced<P, kLevels> makes of P's stack.
///
///     using Stack = hiprt::LevelStack<hiprt::RollingStack<8>, 4>;
///     hiprt::LevelWays<4> ways;  // of the thread
///     Stack::Storage storage({ring, threadIdx.x, kBlock, spill}, ways);
template <class Stack, unsigned kLevels, class Real = float> struct LevelStack : Stack {
  /// Of a stack in the thread's own memory; else void.
  using Memory = typename stack_detail::LevelMemory<Stack, kLevels, Real>::Type;

  struct Storage : Stack::Storage {
    std::uint32_t* ways;
    EnteredObject<Real>* entered;

    HIPRT_HD HIPRT_INLINE Storage(const typename Stack::Storage& stack, LevelWays<kLevels, Real>& memory)
        : Stack::Storage(stack), ways(memory.instance), entered(memory.entered) {}
    template <class OwnMemory>
    requires std::same_as<OwnMemory, Memory> HIPRT_HD HIPRT_INLINE Storage(OwnMemory& memory,
                                                                           std::uint32_t* overflowed = nullptr)
        : Stack::Storage(memory.stack, overflowed), ways(memory.ways.instance), entered(memory.ways.entered) {}
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
