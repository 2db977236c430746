#pragma once
/// Lanes that do a small piece of work together, as steps that are written for a wave see them. On the host it is one
/// lane that does everything in turn. Internal.

#include <hiprt_device/format/portability.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace hiprt::build {

/// One lane of the host.
struct HostGroup {
  /// Elements that all lanes see.
  template <class T, std::size_t N> using Array = std::array<T, N>;

  /// What the lanes wrote can be read by all from here on.
  void sync() const {}
  /// Whether the condition holds for any lane.
  bool any(bool condition) const { return condition; }
  /// @return lane @p lane's value.
  template <class T> T from(unsigned, const T& value) const { return value; }
  /// body(lane) for each lane with the condition; all lanes run it.
  template <class Body> void for_lanes_with(bool condition, Body&& body) const {
    if (condition) body(0u);
  }
  /// body(i) for i in [0, n).
  template <class Body> void for_each(unsigned n, Body&& body) const {
    for (unsigned i = 0; i < n; ++i) body(i);
  }
  /// @return how many of [0, n) test(i) is true for.
  template <class Test> unsigned count(unsigned n, Test&& test) const {
    unsigned result = 0;
    for (unsigned i = 0; i < n; ++i) result += test(i) ? 1 : 0;
    return result;
  }
  /// value = min(value, candidate), for a value that other lanes lower too.
  void lower(std::uint32_t& value, std::uint32_t candidate) const { value = candidate < value ? candidate : value; }
  /// Removes the elements of [0, n) for which keep(i, element) is false; the others close up. keep may change its
  /// element, and read those behind it as they were. @return how many are left.
  template <class T, std::size_t N, class Keep>
  unsigned compact(unsigned n, std::array<T, N>& elements, Keep&& keep) const {
    unsigned to = 0;
    for (unsigned i = 0; i < n; ++i) {
      T element = elements[i];
      if (keep(i, element)) elements[to++] = element;
    }
    return to;
  }
};

}  // namespace hiprt::build
