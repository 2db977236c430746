#pragma once
/// Too little memory as an error value that names the bytes wanted and free. Internal.

#include <hiprt_build/error.h>

#include <cstdint>
#include <initializer_list>
#include <new>
#include <optional>
#include <string_view>
#include <type_traits>

namespace hiprt::build {

/// An allocation that failed, with its size.
class AllocationFailed : public std::bad_alloc {
 public:
  explicit AllocationFailed(std::uint64_t bytes) : bytes_(bytes) {}
  const char* what() const noexcept override { return "not enough memory"; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::uint64_t bytes_;
};

/// @return bytes that this process can still allocate, as far as the system says. Allocates nothing.
std::optional<std::uint64_t> free_memory() noexcept;

/// @param code of the error, unless there is no memory for @p message: then kOutOfMemory with a text that needs none.
Error error_or_out_of_memory(ErrorCode code, const char* message) noexcept;

/// kOutOfMemory: "not enough memory to <action>: 4096 bytes wanted, 512 free". Where the allocation's size is unknown
/// only the free bytes are named. If there is no memory for the text, the message is "out of memory".
/// @param action joined: "to export a tree", or "for the " and "build".
Error out_of_memory(std::initializer_list<std::string_view> action, const std::bad_alloc& failure) noexcept;

/// @return work(), a Result; kOutOfMemory if it throws std::bad_alloc.
/// @param action as "to export a tree".
template <class Work>
auto or_out_of_memory(std::string_view action, const Work& work) -> std::invoke_result_t<const Work&> try {
  return work();
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(out_of_memory({action}, failure));
}

}  // namespace hiprt::build
