#pragma once
/// A traversal stack together with the memory for the levels of instances.

#include <hiprt_device/instances/level_memory.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace stack_detail {

template <class Stack, unsigned kLevels, class Real> struct LevelMemory { using Type = void; };
template <class Stack, unsigned kLevels, class Real>
requires requires { typename Stack::Memory; }
struct LevelMemory<Stack, kLevels, Real> {
  struct Type {
    typename Stack::Memory stack;
    PathMemory<kLevels, Real> path_memory;
  };
};

}  // namespace stack_detail

/// Another stack, with memory for @p kLevels levels. Instanced<P, kLevels> makes it from P's stack.
///
///     using Stack = hiprt::LevelStack<hiprt::RollingStack<8>, 4>;
///     hiprt::PathMemory<4> path_memory;  // of the thread
///     Stack::Storage storage({ring, threadIdx.x, kBlock, spill}, path_memory);
template <class Stack, unsigned kLevels, class Real = float> struct LevelStack : Stack {
  /// Memory of a stack in the thread's own memory; void for other stacks.
  using Memory = typename stack_detail::LevelMemory<Stack, kLevels, Real>::Type;

  struct Storage : Stack::Storage {
    PathMemory<kLevels, Real>* path_memory;

    HIPRT_HD HIPRT_FORCE_INLINE Storage(const typename Stack::Storage& stack, PathMemory<kLevels, Real>& memory)
        : Stack::Storage(stack), path_memory(&memory) {}
    template <class OwnMemory>
    requires std::same_as<OwnMemory, Memory> HIPRT_HD HIPRT_FORCE_INLINE Storage(OwnMemory& memory,
                                                                                 std::uint32_t* overflowed = nullptr)
        : Storage(typename Stack::Storage(memory.stack, overflowed), memory.path_memory) {}
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
