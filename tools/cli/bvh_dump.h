#pragma once
/// Every node and leaf of a file, as text or as JSON lines.

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <ostream>

namespace hiprt::tools {

/// Where a reference leads, a node or the first leaf of a run, by number: {"node": n} or {"leaf": n}.
nlohmann::json target_json(const BufferView& view, NodeRef ref);

/// One line per node with its present children (reference and box), one per leaf with its primitives. Boxes of nodes
/// are those that its bytes decode to; an infinite plane (layout half) is the file's bounds.
/// @pre validate() accepted the file.
void dump_text(const BufferView& view, std::ostream& out);

/// The same, one JSON object per line: {"node": n, "byte": ..., "children": [{"ref", "node" or "leaf", "min", "max"}]},
/// {"leaf": n, "byte": ..., "geometry", "last", "triangles": [{"primitive", "corners": [[x, y, z], ...]}]}. Corners
/// are in the mesh's order. Custom leaves have "customs": [{"primitive", "min", "max"}] in place of "triangles", those
/// of instances "instance", "enters" (where rays enter the object, a reference in its file), "min" and "max".
void dump_json(const BufferView& view, std::ostream& out);

}  // namespace hiprt::tools
