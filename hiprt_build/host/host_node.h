#pragma once
/// Nodes of eight children that a host makes of a file's nodes (HostPart). They are not part of a file. Internal.

#include <hiprt_device/format/node.h>

#include <cstddef>
#include <cstdint>

namespace hiprt {

/// Children of a HostNode.
inline constexpr unsigned kWideBranching = 8;
/// Leaves side by side that one reference of a HostNode may count.
inline constexpr unsigned kMostWideLeaves = 4;
/// Nodes that a ray may have to visit later. make_host_nodes() makes no trees that need more.
inline constexpr unsigned kHostStack = 192;

struct HostNode;

/// What a child of a HostNode is: an address with a tag in its low bits, so that nothing is computed before a visit.
class HostRef {
 public:
  HostRef() = default;  ///< Not initialised: a search has room for many.
  static HostRef none() { return HostRef(kNone); }
  explicit HostRef(const HostNode* node) : bits_(reinterpret_cast<std::uintptr_t>(node)) {}
  /// Leaves of the file, side by side. Their kLastInRun does not count.
  /// @param count 1 to kMostWideLeaves.
  HostRef(const PlanesLeaf* first, unsigned count) : bits_(reinterpret_cast<std::uintptr_t>(first) | count) {}
  /// Leaves of the file up to the one with kLastInRun.
  static HostRef long_run(const PlanesLeaf* first) { return HostRef(first, kLongRun); }

  /// A node of an array whose address is not known yet. Of the following only is_node() and number() may be called.
  static HostRef numbered(std::size_t number) { return HostRef(number * kNodeSize); }
  std::size_t number() const { return bits_ / kNodeSize; }

  bool is_node() const { return (bits_ & kTags) == 0; }
  bool is_none() const { return bits_ == kNone; }
  bool is_long_run() const { return (bits_ & kTags) == kLongRun; }
  /// @pre is_node()
  const HostNode* node() const { return reinterpret_cast<const HostNode*>(bits_); }
  /// @pre it names leaves
  const PlanesLeaf* leaves() const { return reinterpret_cast<const PlanesLeaf*>(bits_ & ~kTags); }
  /// @pre it names leaves, and is not a long run
  unsigned leaf_count() const { return static_cast<unsigned>(bits_ & kTags); }
  /// First byte of what it names.
  const char* address() const { return reinterpret_cast<const char*>(bits_ & ~kTags); }

 private:
  explicit HostRef(std::uintptr_t bits) : bits_(bits) {}

  static constexpr std::uintptr_t kNodeSize = 256;
  static constexpr std::uintptr_t kTags = 7, kLongRun = kMostWideLeaves + 1, kNone = kLongRun + 1;
  std::uintptr_t bits_;
};

/// plane[axis][side][child], side 0 = minimum, 1 = maximum. Absent children have the empty box.
struct alignas(64) HostNode {
  float plane[3][2][kWideBranching];
  HostRef child[kWideBranching];
};
static_assert(sizeof(HostNode) == 256 || sizeof(void*) != 8);  // HostRef::kNodeSize

}  // namespace hiprt
