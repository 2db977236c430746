/// bvhinfo: describes a BVH file.

#include <tools/base/output_file.h>
#include <tools/cli/build/build_names.h>
#include <tools/cli/build/scene_figures.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/info/bvh_dump.h>
#include <tools/cli/info/upgrade_command.h>
#include <tools/cli/report.h>
#include <tools/scene_io/exchange_json.h>

#include <hiprt_build/statistics.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <iostream>
#include <optional>
#include <utility>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhinfo",
    "Describes a BVH file: header, sections, geometries, statistics of the tree, provenance.\n"
    "For a scene of instances it also counts each level, and the memory of each part. The statistics of the tree,\n"
    "--dump and --export are then about the scene's own tree over instances.\n"
    "\n"
    "Header and section table are always checked: if they are wrong, the exit status is 1. Statistics that need a\n"
    "walk through the tree (depth, fill, SAH cost, overlap) need content that passes validation. Otherwise they are\n"
    "missing, and a warning says why. With --validate, --dump or --export invalid content is an error with exit\n"
    "status 1.\n"
    "\n"
    "--upgrade validates a file and writes it in the newest version of the format. Rays have the same hits in both.",
    "  bvhinfo scene.bvh                              # describe a file\n"
    "  bvhinfo --validate scene.bvh && echo valid     # check a file\n"
    "  bvhinfo --json scene.bvh | jq .tree.sah_cost   # one number for a script\n"
    "  bvhinfo --dump --json scene.bvh | head         # every node, leaf and instance\n"
    "  bvhinfo scene.bvh --export tree.json           # the tree, for bvhbuild --import\n"
    "  bvhinfo --upgrade old.bvh new.bvh              # the same BVH in the newest version of the format\n"};

struct Options {
  std::string path;
  bool validate = false, dump = false;
  std::string exported;  ///< Empty: none.
  bool upgrade = false;
  std::string upgraded;          ///< The output of upgrade.
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("FILE", options.path, "BVH file to describe")->required()->type_name("")->group(kInputGroup);
  app.add_flag("--validate", options.validate, "Fail unless the whole content is valid")
      ->disable_flag_override()
      ->group(kInputGroup);
  CLI::Option* dump = app.add_flag("--dump", options.dump,
                                   "Print every node, leaf and instance instead. With --json one object per line")
                          ->disable_flag_override()
                          ->group(kOutputGroup);
  CLI::Option* exported =
      app.add_option("--export", options.exported,
                     "Write the tree to this file instead, as JSON that bvhbuild --import takes with the same meshes")
          ->excludes(dump)
          ->type_name("FILE")
          ->group(kOutputGroup);
  CLI::Option* upgrade = app.add_flag("--upgrade", options.upgrade, "Write FILE to OUT in the newest version instead")
                             ->disable_flag_override()
                             ->excludes(dump)
                             ->excludes(exported)
                             ->group(kOutputGroup);
  CLI::Option* out = app.add_option("OUT", options.upgraded, "File that --upgrade writes")
                         ->needs(upgrade)
                         ->type_name("")
                         ->group(kOutputGroup);
  upgrade->needs(out);
  add_memory_option(app, options.max_memory);
}

std::string section_name(std::uint32_t kind) {
  switch (static_cast<SectionKind>(kind)) {
    case SectionKind::kNodes:
      return "nodes";
    case SectionKind::kLeaves:
      return "leaves";
    case SectionKind::kPrimitiveMap:
      return "primitive map";
    case SectionKind::kGeometries:
      return "geometries";
    case SectionKind::kProvenance:
      return "provenance";
    case SectionKind::kInstances:
      return "instances";
    case SectionKind::kObjects:
      return "objects";
    case SectionKind::kObjectFiles:
      return "object files";
    case SectionKind::kMotions:
      return "motions";
    case SectionKind::kMotionSegments:
      return "motion segments";
    case SectionKind::kShapes:
      return "shapes";
    case SectionKind::kShapePoints:
      return "points of shapes";
    case SectionKind::kCurveSegments:
      return "segments of curves";
    case SectionKind::kObjectShapes:
      return "objects' shapes";
  }
  return "unknown kind " + std::to_string(kind);
}

/// Records of a section.
std::uint64_t record_count(const BufferView& view, const SectionEntry& section) {
  return section.kind == static_cast<std::uint32_t>(SectionKind::kNodes) ? view.node_count() : section.count;
}

/// Records and their size.
std::string section_text(const BufferView& view, const SectionEntry& section) {
  const bool gaps = section.kind == static_cast<std::uint32_t>(SectionKind::kNodes) && view.node_places().has_gaps();
  const std::uint64_t size = gaps ? node_size(view.layout()) : section.stride;
  return section_name(section.kind) + ": " + std::to_string(record_count(view, section)) + " x " +
         std::to_string(size) + " bytes at " + std::to_string(section.offset) +
         (gaps ? ", 64 unused after every 64" : "");
}

std::span<const SectionEntry> section_table(const BufferView& view) {
  return {reinterpret_cast<const SectionEntry*>(view.bytes.data() + sizeof(FileHeader)), view.header->section_count};
}

std::vector<std::string> feature_names(FeatureMask features) {
  std::vector<std::string> names;
  if ((features & feature_bit(Feature::kTriangles)) != 0) names.emplace_back("triangles");
  if ((features & feature_bit(Feature::kMasks)) != 0) names.emplace_back("masks");
  if ((features & feature_bit(Feature::kSplitReferences)) != 0) names.emplace_back("split references");
  if ((features & feature_bit(Feature::kCustom)) != 0) names.emplace_back("custom primitives");
  if ((features & feature_bit(Feature::kInstances)) != 0) names.emplace_back("instances");
  if ((features & feature_bit(Feature::kMotion)) != 0) names.emplace_back("motion");
  if ((features & feature_bit(Feature::kMovingBoxes)) != 0) names.emplace_back("moving boxes");
  if ((features & feature_bit(Feature::kWidenedBoxes)) != 0) names.emplace_back("widened boxes");
  return names;
}

/// nullopt unless the text is a JSON object whose depth is sane (printing a value takes stack for every level).
std::optional<nlohmann::json> parse_provenance(std::string_view text) {
  constexpr int kMostLevels = 64;
  bool too_deep = false;
  const auto guard = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    too_deep = too_deep || depth > kMostLevels;
    return depth <= kMostLevels;
  };
  auto value = nlohmann::json::parse(text, guard, false);
  if (value.is_discarded() || too_deep || !value.is_object()) return std::nullopt;
  return std::optional<nlohmann::json>(std::in_place, std::move(value));
}

std::string bounds_text(const Box& box) {
  std::string text;
  for (const float* corner : {box.min, box.max}) {
    text += text.empty() ? "(" : " - (";
    for (int axis = 0; axis < 3; ++axis) text += (axis == 0 ? "" : " ") + nlohmann::json(corner[axis]).dump();
    text += ")";
  }
  return text;
}

ShapeKind shape_of(const BufferView& view, std::size_t geometry) {
  return view.shapes.empty() ? ShapeKind::kNone : view.shapes[geometry].kind;
}

/// "custom primitives of type 7", "spheres of type 0", "segments of curves of type 1, 12 points", "moving triangles of
/// type 2, 8 vertices, 3 keys".
std::string custom_text(const BufferView& view, std::size_t i) {
  const ShapeKind shape = shape_of(view, i);
  const std::string type = " of type " + std::to_string(geometry_type(view.geometries[i].flags));
  if (shape == ShapeKind::kSpheres) return "spheres" + type;
  if (shape == ShapeKind::kMovingTriangles) {
    const ShapeRecord& record = view.shapes[i];
    return "moving triangles" + type + ", " + std::to_string(record.point_count / record.keys) + " vertices, " +
           std::to_string(record.keys) + " keys";
  }
  if (shape != ShapeKind::kCurves) return "custom primitives" + type;
  return "segments of curves" + type + ", " + std::to_string(view.shapes[i].point_count) + " points";
}

std::string geometry_text(const BufferView& view, std::size_t i) {
  const GeometryRecord& geometry = view.geometries[i];
  const bool custom = (geometry.flags & kGeometryCustom) != 0;
  return std::to_string(geometry.primitive_count) + " " +
         (view.has_instances() ? "instances"
          : custom             ? custom_text(view, i)
                               : "triangles") +
         ", " + std::to_string(geometry.dropped_count) + " dropped";
}

/// "triangles", "instances", or "customs" and their "type"; "shapes" and "points" if the file says what those are.
nlohmann::json geometry_json(const BufferView& view, std::size_t i) {
  const GeometryRecord& geometry = view.geometries[i];
  const bool instances = view.has_instances();
  const bool custom = (geometry.flags & kGeometryCustom) != 0 && !instances;
  nlohmann::json result{{"first_primitive", geometry.first_primitive},
                        {instances ? "instances"
                         : custom  ? "customs"
                                   : "triangles",
                         geometry.primitive_count},
                        {"dropped", geometry.dropped_count},
                        {"mask", geometry.mask}};
  if (custom) result["type"] = geometry_type(geometry.flags);
  const ShapeKind shape = shape_of(view, i);
  if (shape == ShapeKind::kNone) return result;
  result["shapes"] = shape == ShapeKind::kCurves    ? "curves"
                     : shape == ShapeKind::kSpheres ? "spheres"
                                                    : "moving triangles";
  result["points"] = view.shapes[i].point_count;
  if (shape == ShapeKind::kMovingTriangles) result["keys"] = view.shapes[i].keys;
  return result;
}

/// Everything that header, section table and geometry table say.
void add_header(Table& table, const Options& options, const BufferView& view) {
  const FileHeader& header = *view.header;
  std::string features;
  for (const std::string& name : feature_names(header.features)) features += (features.empty() ? "" : ", ") + name;
  table.row("file", options.path);
  table.row("version", std::to_string(header.version_major) + "." + std::to_string(header.version_minor));
  table.row("layout", word_of(kLayouts, view.layout()));
  table.row("features", features.empty() ? "none" : features);
  table.row("bytes", bytes_text(header.byte_size));
  add_bytes_per_primitive(table, view);
  if (!view.has_instances()) table.row("triangles", std::to_string(count_triangles(view)));
  if (count_customs(view) != 0) table.row("custom primitives", std::to_string(count_customs(view)));
  table.row("bounds", header.root == kInvalidRef ? "empty" : bounds_text(header.bounds));
  if (header.box_margin != 0) table.row("box margin", nlohmann::json(header.box_margin).dump());
  table.row("stack bound", std::to_string(header.stack_bound));
  for (const SectionEntry& s : section_table(view)) table.row("section", section_text(view, s));
  constexpr std::size_t kMostGeometries = 20;
  for (std::size_t i = 0; i < std::min(view.geometries.size(), kMostGeometries); ++i)
    table.row("geometry " + std::to_string(i), geometry_text(view, i));
  if (view.geometries.size() > kMostGeometries)
    table.row("more geometries", std::to_string(view.geometries.size() - kMostGeometries) + " (--json has all)");
}

nlohmann::json header_json(const Options& options, const BufferView& view) {
  const FileHeader& header = *view.header;
  nlohmann::json sections = nlohmann::json::array(), geometries = nlohmann::json::array();
  for (const SectionEntry& s : section_table(view))
    sections.push_back({{"kind", s.kind},
                        {"name", section_name(s.kind)},
                        {"offset", s.offset},
                        {"count", record_count(view, s)},
                        {"stride", s.stride}});
  for (std::size_t i = 0; i < view.geometries.size(); ++i) geometries.push_back(geometry_json(view, i));
  nlohmann::json bounds;
  if (header.root != kInvalidRef) bounds = {{"min", header.bounds.min}, {"max", header.bounds.max}};
  return {{"file", options.path},
          {"version", {header.version_major, header.version_minor}},
          {"layout", word_of(kLayouts, view.layout())},
          {"features", feature_names(header.features)},
          {"bytes", header.byte_size},
          {"bytes_per_triangle", bytes_per_primitive(view)},
          {"triangles", count_triangles(view)},
          {"customs", count_customs(view)},
          {"bounds", std::move(bounds)},
          {"box_margin", header.box_margin},
          {"stack_bound", header.stack_bound},
          {"sections", std::move(sections)},
          {"geometries", std::move(geometries)}};
}

void print_text(const Options& options, const BufferView& view, bool valid) {
  Table table;
  add_header(table, options, view);
  table.row("valid", valid ? "yes" : "no");
  if (valid && view.has_instances()) add_scene(table, measure_scene(view));
  if (valid) add_tree(table, build::measure_tree(view));
  const auto provenance = parse_provenance(view.provenance);
  std::cout << table.text();
  if (provenance)
    std::cout << "provenance " << provenance->dump(2, ' ', true, nlohmann::json::error_handler_t::replace) << "\n";
  else
    std::cout << "provenance " << (view.provenance.empty() ? "none" : "not readable") << "\n";
}

void print_json(const Cli& cli, const Options& options, const BufferView& view, const FormatIssue* issue) {
  nlohmann::json report = header_json(options, view);
  report["valid"] = issue == nullptr;
  report["error"] = nullptr;
  if (issue != nullptr)
    report["error"] = {{"message", to_string(*issue)},
                       {"name", name(issue->error)},
                       {"byte", issue->offset},
                       {"found", issue->value},
                       {"limit", issue->limit}};
  report["scene"] = nullptr;
  if (issue == nullptr && view.has_instances()) report["scene"] = scene_json(measure_scene(view));
  report["tree"] = nullptr;
  if (issue == nullptr) report["tree"] = tree_json(build::measure_tree(view));
  const auto provenance = parse_provenance(view.provenance);
  report["provenance"] = provenance ? *provenance : nlohmann::json();
  cli.print(report);
}

build::Result<void> write_tree(const Cli& cli, const Options& options, const BufferView& view) {
  if (auto checked = check_output(options.exported, {&options.path, 1}); !checked) return checked;
  const auto tree = build::export_tree(view);
  if (!tree) return tl::unexpected(build::Error{tree.error().code, options.path + ": " + tree.error().message});
  if (auto written = write_exchange(options.exported, *tree); !written) return written;
  if (cli.json())
    cli.print({{"file", options.exported}, {"nodes", tree->nodes.size()}, {"primitives", tree->primitives.size()}});
  return {};
}

build::Result<void> run(const Cli& cli, const Options& options) {
  if (options.upgrade) return run_upgrade(cli, options.path, options.upgraded, options.max_memory);
  const auto file = open_bvh(options.path, options.max_memory);
  if (!file) return tl::unexpected(file.error());
  if (!options.exported.empty()) return write_tree(cli, options, file->view);
  const auto valid = validate_on(0, file->view.bytes);
  if (!valid && options.dump) return tl::unexpected(format_error(options.path, valid.error()));
  if (options.dump) {
    cli.json() ? dump_json(file->view, std::cout) : dump_text(file->view, std::cout);
    return {};
  }
  if (cli.json())
    print_json(cli, options, file->view, valid ? nullptr : &valid.error());
  else
    print_text(options, file->view, valid.has_value());
  if (valid) return {};
  const build::Error error = format_error(options.path, valid.error());
  if (options.validate) return tl::unexpected(error);
  cli.warn(error.message + "; figures of the tree are left out");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Cli cli(kInfo);
  add_options(cli.app(), options);
  return cli.run(argc, argv, [&] { return run(cli, options); });
}
