#pragma once
/// The arrays that a caller gives to a GPU build or refit. Internal.

#include <hiprt_build/gpu/build.h>
#include <hiprt_build/input/geometry.h>

namespace hiprt::gpu {

/// @pre check_arrays() accepts the geometry.
HIPRT_HD inline build::GeometryView view_of(const DeviceGeometry& geometry) {
  using build::GeometryView;
  GeometryView view = geometry.boxes != nullptr
                          ? GeometryView::of_boxes(geometry.boxes, geometry.primitive_count, geometry.box_stride,
                                                   geometry.box_upper, geometry.type)
                          : GeometryView::of_mesh(geometry.positions, geometry.position_count, geometry.position_stride,
                                                  geometry.implicit_triangles ? nullptr : geometry.triangles,
                                                  geometry.primitive_count, geometry.triangle_stride);
  if (geometry.boxes == nullptr) view.flags = mesh_flags(geometry.type);
  view.mask = geometry.mask;
  view.given_pairs = geometry.pairs != nullptr && geometry.pair_count != 0;
  return view;
}

/// Checks pointers, strides and type.
/// @param i its number, for the message.
Result<void> check_arrays(const DeviceGeometry& geometry, std::size_t i);

}  // namespace hiprt::gpu
