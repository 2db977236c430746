#pragma once
/// A second check of accepted files: walks the tree as a traversal does and checks every access. It uses the numbers of
/// the specification, not the library's decoding.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace hiprt::test {

class SafeWalk {
 public:
  explicit SafeWalk(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// @return the fault that a traversal of all children, in either order, meets; "" if none.
  std::string run() {
    read_table();
    for (const bool backward : {false, true})
      if (problem_.empty()) walk(backward);
    return problem_;
  }

 private:
  struct Section {
    std::uint64_t offset, count, stride;
  };

  template <class T> T read(std::uint64_t offset) {
    T value{};
    if (offset + sizeof(T) <= bytes_.size())
      std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    else
      problem_ = "read out of the file";
    return value;
  }

  void read_table() {
    layout_ = read<std::uint32_t>(12);
    const auto count = read<std::uint32_t>(40);
    for (std::uint64_t at = 128; at < 128 + 32 * std::uint64_t{count}; at += 32)
      section_[read<std::uint32_t>(at)] = {read<std::uint64_t>(at + 8), read<std::uint64_t>(at + 16),
                                           read<std::uint64_t>(at + 24)};
  }

  bool inside(std::uint64_t offset, std::uint32_t kind) {
    const Section section = section_[kind];
    if (offset >= section.offset && offset < section.offset + section.count * section.stride) return true;
    problem_ = "reference out of its section";
    return false;
  }

  void walk_run(std::uint64_t offset, bool custom) {
    for (;; offset += 64) {
      if (!inside(offset, 2)) return;
      const auto geometry = read<std::uint32_t>(offset + 56);
      if ((geometry & 0x0fffffffu) >= section_[4].count) problem_ = "geometry id";
      const std::uint64_t record = section_[4].offset + 32 * (geometry & 0x0fffffffu);
      if (((read<std::uint32_t>(record + 28) & 1u) != 0) != custom) problem_ = "kind of leaf";
      const auto primitives = read<std::uint64_t>(record + 8);
      const auto second = read<std::uint32_t>(offset + 52);
      if (read<std::uint32_t>(offset + 48) >= primitives) problem_ = "primitive id";
      if (second != 0xffffffffu && second >= primitives) problem_ = "second primitive id";
      if ((geometry & 0x80000000u) != 0 || !problem_.empty()) return;
    }
  }

  std::vector<std::uint32_t> read_children(std::uint64_t node, bool backward) {
    std::vector<std::uint32_t> children;
    unsigned present = 0;
    for (unsigned i = 0; i < 4; ++i) {
      const unsigned c = backward ? 3 - i : i;
      const auto child = read<std::uint32_t>(node + (layout_ == 4 ? 16 : 0) + 4 * c);
      if (child == 0xffffffffu) continue;
      children.push_back(child);
      present |= 1u << c;
    }
    // A traversal of quantized nodes knows absent children by this byte alone.
    if (layout_ == 4 && (read<std::uint8_t>(node + 15) & 15u) != present) problem_ = "children byte";
    if (layout_ == 4 && (read<std::uint8_t>(node + 15) & 0x30u) == 0x30) problem_ = "order axis";
    return children;
  }

  /// Depth first with a stack of at most the header's bound, first child first or last child first.
  void walk(bool backward) {
    const auto bound = read<std::uint32_t>(48);
    std::vector<std::uint32_t> stack;
    std::uint64_t visits = 0;
    std::uint32_t current = read<std::uint32_t>(44);
    while (problem_.empty() && current != 0xffffffffu) {
      if (++visits > bytes_.size()) problem_ = "loop";
      std::vector<std::uint32_t> children;
      const std::uint64_t offset = std::uint64_t{current >> 3} * 64;
      if ((current & 7u) == 0 || (current & 7u) == 7)
        walk_run(offset, (current & 7u) == 7);
      else if ((current & 7u) == (layout_ == 3 ? 4u : 5u) && inside(offset, 1))
        children = read_children(offset, backward);
      else
        problem_ = "node type";
      for (std::size_t c = 1; c < children.size(); ++c) stack.push_back(children[c]);
      if (stack.size() > bound) problem_ = "stack overflow";
      if (children.empty() && stack.empty()) return;
      current = children.empty() ? stack.back() : children[0];
      if (children.empty()) stack.pop_back();
    }
  }

  std::span<const std::byte> bytes_;
  std::uint32_t layout_ = 0;
  std::map<std::uint32_t, Section> section_;
  std::string problem_;
};

inline std::string walk_problem(std::span<const std::byte> bytes) { return SafeWalk(bytes).run(); }

}  // namespace hiprt::test
