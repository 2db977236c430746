#include <tools/cli/info/bvh_dump.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>

namespace hiprt::tools {
namespace {

using nlohmann::json;

template <class Layout> json node_json(const BufferView& view, const typename Layout::Node& node, std::size_t index) {
  json children = json::array();
  for (unsigned i = 0; i < kBranching; ++i) {
    if (node.child[i] == kInvalidRef) continue;
    // JSON has no infinity.
    const Box stated = Layout::box(node, i);
    const Box box = Layout::kId == NodeLayout::kHalf ? bounded(stated, view.header->bounds) : stated;
    json child = target_json(view, node.child[i]);
    child["ref"] = node.child[i];
    child["min"] = box.min;
    child["max"] = box.max;
    children.push_back(std::move(child));
  }
  return {{"node", index},
          {"byte", view.nodes.offset + view.node_places().offset(index)},
          {"children", std::move(children)}};
}

/// Stored corner that is the mesh's corner k: bits of the triangle-id byte.
unsigned stored_corner(std::uint32_t id, unsigned k) {
  const unsigned u = TriangleId::u_source(id), v = TriangleId::v_source(id);
  return k == 1 ? u : k == 2 ? v : 3 - u - v;
}

/// What leaves of both kinds have.
json leaf_json(const BufferView& view, const LeafInfo& info, std::size_t index) {
  return {{"leaf", index},
          {"byte", view.leaves.offset + index * view.leaves.stride},
          {"geometry", info.geometry_and_flags & kGeometryMask},
          {"last", (info.geometry_and_flags & kLastInRun) != 0}};
}

template <class Layout>
json triangle_leaf_json(const BufferView& view, const typename Layout::Leaf& leaf, std::size_t index) {
  json triangles = json::array();
  for (unsigned t = 0; t < 2; ++t) {
    if (leaf.info.primitive[t] == kInvalidId) continue;
    json corners = json::array();
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned vertex = corner_vertex(t, stored_corner(leaf.info.triangle_ids >> (8 * t) & 0xffu, k));
      corners.push_back({Layout::coordinate(leaf, vertex, 0), Layout::coordinate(leaf, vertex, 1),
                         Layout::coordinate(leaf, vertex, 2)});
    }
    triangles.push_back({{"primitive", leaf.info.primitive[t]}, {"corners", std::move(corners)}});
  }
  json result = leaf_json(view, leaf.info, index);
  result["triangles"] = std::move(triangles);
  return result;
}

bool is_custom(const BufferView& view, const LeafInfo& info) {
  return (view.geometries[info.geometry_and_flags & kGeometryMask].flags & kGeometryCustom) != 0;
}

json instance_leaf_json(const BufferView& view, const CustomLeaf& leaf, std::size_t index) {
  json result = leaf_json(view, leaf.info, index);
  result["instance"] = leaf.info.primitive[0];
  result["enters"] = entered_ref(leaf.info);
  if (!view.has_moving_boxes()) {
    result["min"] = leaf.box[0].min;
    result["max"] = leaf.box[0].max;
    return result;
  }
  for (const auto& [when, box] : {std::pair("begin", &leaf.box[0]), {"end", &leaf.box[1]}})
    result[when] = {{"min", box->min}, {"max", box->max}};
  return result;
}

json custom_leaf_json(const BufferView& view, const CustomLeaf& leaf, std::size_t index) {
  if (view.has_instances()) return instance_leaf_json(view, leaf, index);
  json customs = json::array();
  for (unsigned i = 0; i < 2; ++i)
    if (leaf.info.primitive[i] != kInvalidId)
      customs.push_back({{"primitive", leaf.info.primitive[i]}, {"min", leaf.box[i].min}, {"max", leaf.box[i].max}});
  json result = leaf_json(view, leaf.info, index);
  result["customs"] = std::move(customs);
  return result;
}

json instance_json(const BufferView& view, std::size_t index) {
  const InstanceRecord& record = view.instances[index];
  return {{"record", index},         {"byte", view.instance_entry.offset + index * sizeof(InstanceRecord)},
          {"linear", record.linear}, {"translation", record.translation},
          {"object", record.object}, {"mask", record.mask},
          {"id", record.id},         {"flags", record.flags}};
}

/// Calls line(json) for every node, then every leaf and instance, as long as @p out takes more.
template <class Line> void for_each_record(const BufferView& view, const std::ostream& out, Line&& line) {
  dispatch_layout(view.layout(), [&](auto layout) {
    using Layout = decltype(layout);
    const auto nodes = view.node_array<typename Layout::Node>();
    const std::size_t count = view.node_count();
    for (std::size_t i = 0; i < count && out; ++i) line(node_json<Layout>(view, nodes[i], i));
    const auto leaves = view.records<typename Layout::Leaf>(view.leaves);
    for (std::size_t i = 0; i < leaves.size() && out; ++i)
      line(is_custom(view, leaves[i].info) ? custom_leaf_json(view, custom_leaf(leaves[i]), i)
                                           : triangle_leaf_json<Layout>(view, leaves[i], i));
  });
  for (std::size_t i = 0; i < view.instances.size() && out; ++i) line(instance_json(view, i));
}

std::string point_text(const json& p) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "(%.9g %.9g %.9g)", p[0].get<double>(), p[1].get<double>(),
                p[2].get<double>());
  return text.data();
}

std::string box_text(const json& box) { return point_text(box["min"]) + " - " + point_text(box["max"]); }

void write_node(const json& record, std::ostream& out) {
  out << "node " << record["node"] << " @" << record["byte"] << "\n";
  for (const json& child : record["children"]) {
    const char* kind = child.contains("node") ? "node" : "leaf";
    out << "  " << kind << " " << child[kind] << " " << box_text(child) << "\n";
  }
}

void write_leaf(const json& record, std::ostream& out) {
  out << "leaf " << record["leaf"] << " @" << record["byte"] << " geometry " << record["geometry"]
      << (record["last"].get<bool>() ? " last of run\n" : "\n");
  if (record.contains("instance")) {
    out << "  instance " << record["instance"] << " enters " << record["enters"] << " ";
    if (record.contains("min"))
      out << box_text(record) << "\n";
    else
      out << "begin " << box_text(record["begin"]) << " end " << box_text(record["end"]) << "\n";
    return;
  }
  if (record.contains("customs")) {
    for (const json& custom : record["customs"])
      out << "  custom primitive " << custom["primitive"] << " " << box_text(custom) << "\n";
    return;
  }
  for (const json& triangle : record["triangles"]) {
    out << "  primitive " << triangle["primitive"];
    for (const json& corner : triangle["corners"]) out << " " << point_text(corner);
    out << "\n";
  }
}

void write_instance(const json& record, std::ostream& out) {
  out << "instance " << record["record"] << " @" << record["byte"] << " object " << record["object"] << " id "
      << record["id"] << " mask " << record["mask"] << " flags " << record["flags"] << "\n  to object";
  for (const json& row : record["linear"]) out << " " << point_text(row);
  out << " * (p - " << point_text(record["translation"]) << ")\n";
}

}  // namespace

json target_json(const BufferView& view, NodeRef ref) {
  if (is_box(ref)) return {{"node", view.node_number(ref)}};
  return {{"leaf", (ref_offset(ref) - view.leaves.offset) / view.leaves.stride}};
}

void dump_text(const BufferView& view, std::ostream& out) {
  for_each_record(view, out, [&](const json& record) {
    if (record.contains("record"))
      write_instance(record, out);
    else
      record.contains("node") ? write_node(record, out) : write_leaf(record, out);
  });
}

void dump_json(const BufferView& view, std::ostream& out) {
  for_each_record(view, out, [&](const json& record) { out << record.dump() << "\n"; });
}

}  // namespace hiprt::tools
