#pragma once
/// Calls a function with the type of a file's layout.

#include <hiprt_device/format/layout.h>

namespace hiprt {

/// Calls function(LayoutType{}) for the layout of a file. @pre open_buffer() accepted the file.
template <class Function> constexpr decltype(auto) dispatch_layout(NodeLayout layout, Function&& function) {
  switch (layout) {
    case NodeLayout::kFloat:
      return function(FloatLayout{});
    case NodeLayout::kHalf:
      return function(HalfLayout{});
    case NodeLayout::kQuantized:
      return function(QuantizedLayout{});
    default:
      return function(PlanesLayout{});
  }
}

/// Size of a layout's box nodes in bytes.
constexpr std::uint64_t node_size(NodeLayout layout) {
  return dispatch_layout(layout, [](auto tag) -> std::uint64_t { return sizeof(typename decltype(tag)::Node); });
}

}  // namespace hiprt
