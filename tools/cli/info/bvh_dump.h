#pragma once
/// Every node, leaf and instance of a file, as text or as JSON lines.

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <ostream>

namespace hiprt::tools {

/// The target of a reference by number, a node or the first leaf of a run: {"node": n} or {"leaf": n}.
nlohmann::json target_json(const BufferView& view, NodeRef ref);

/// Prints one line per node with its children (reference and box), and one line per leaf with its primitives. Scenes of
/// instances also have a line per InstanceRecord. Boxes are decoded from the node. For an infinite plane (layout half)
/// the file's bounds are printed.
/// @pre validate() accepted the file.
void dump_text(const BufferView& view, std::ostream& out);

/// The same, one JSON object per line: {"node": n, "byte": ..., "children": [{"ref", "node" or "leaf", "min", "max"}]},
/// {"leaf": n, "byte": ..., "geometry", "last", "triangles": [{"primitive", "corners": [[x, y, z], ...]}]}. Corners
/// are in the mesh's order. Custom leaves have "customs": [{"primitive", "min", "max"}] instead of "triangles". Leaves
/// of instances have "instance", "enters" (the node of the object that rays enter), "min" and "max". Instances are
/// {"record": n, "byte": ..., "linear", "translation", "object", "mask", "id", "flags"}.
void dump_json(const BufferView& view, std::ostream& out);

}  // namespace hiprt::tools
