/// The pages of the format and the code list the same fields at the same offsets and the same constants.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/instance.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/format/node.h>
#include <hiprt_device/format/shape.h>

#include <tests/catch.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

using namespace hiprt;

namespace {

using Row = std::vector<std::string>;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

using Tables = std::map<std::string, std::vector<Row>>;

void read_page(const std::string& name, Tables& tables) {
  std::ifstream file(std::string(HIPRT_FORMAT_PAGES) + "/" + name);
  REQUIRE(file);
  std::string line, heading;
  while (std::getline(file, line)) {
    if (line.rfind('#', 0) == 0) heading = trimmed(line.substr(line.find_first_not_of('#')));
    if (line.rfind('|', 0) != 0) continue;
    std::istringstream cells(line.substr(1));
    Row row;
    for (std::string cell; std::getline(cells, cell, '|');) row.push_back(trimmed(cell));
    tables[heading].push_back(row);
  }
}

/// Heading (without the #) -> rows of the table below it, header and rule left out.
Tables read_tables() {
  Tables tables;
  for (const char* name : {"FORMAT.md", "FORMAT_NODES.md", "FORMAT_INSTANCES.md"}) read_page(name, tables);
  for (auto& [name, rows] : tables) {
    REQUIRE(rows.size() > 2);
    rows.erase(rows.begin(), rows.begin() + 2);
  }
  return tables;
}

/// How the specification writes a type.
template <class T> std::string type_name() {
  if constexpr (std::is_array_v<T>) {
    // The outer bound comes first: f32[3][2][4].
    const std::string element = type_name<std::remove_all_extents_t<T>>();
    std::string bounds = "[" + std::to_string(std::extent_v<T, 0>) + "]";
    if constexpr (std::rank_v < T >> 1) bounds += "[" + std::to_string(std::extent_v<T, 1>) + "]";
    if constexpr (std::rank_v < T >> 2) bounds += "[" + std::to_string(std::extent_v<T, 2>) + "]";
    return element + bounds;
  } else if constexpr (std::is_same_v<T, Box>) {
    return "Box";
  } else if constexpr (std::is_same_v<T, HalfBoxNode::HalfBox>) {
    return "HalfBox";
  } else if constexpr (std::is_same_v<T, LeafInfo>) {
    return "LeafInfo";
  } else if constexpr (std::is_same_v<T, TurningSegment>) {
    return "TurningSegment";
  } else if constexpr (std::is_enum_v<T>) {
    return type_name<std::underlying_type_t<T>>();
  } else if constexpr (std::is_same_v<T, char>) {
    return "char";
  } else if constexpr (std::is_same_v<T, float>) {
    return "f32";
  } else {
    static_assert(std::is_unsigned_v<T>);
    return "u" + std::to_string(8 * sizeof(T));
  }
}

/// The first three cells of a row.
std::string field_row(std::size_t offset, const std::string& type, const std::string& name) {
  return std::to_string(offset) + " " + type + " " + name;
}

#define FIELD(record, name) field_row(offsetof(record, name), type_name<decltype(record::name)>(), #name)

struct RecordSpec {
  std::string heading;
  std::size_t size;
  std::size_t field_bytes;  ///< Sum of the fields' sizes: equal to the size, as there is no padding.
  std::vector<std::string> fields;
};

#define SIZE(record, name) sizeof(record::name)

std::size_t sum(std::initializer_list<std::size_t> sizes) {
  std::size_t total = 0;
  for (const std::size_t size : sizes) total += size;
  return total;
}

std::vector<RecordSpec> container_records() {
#define HEADER(X)                                                                                               \
  X(FileHeader, magic), X(FileHeader, version_major), X(FileHeader, version_minor), X(FileHeader, layout),      \
      X(FileHeader, features), X(FileHeader, byte_size), X(FileHeader, checksum), X(FileHeader, section_count), \
      X(FileHeader, root), X(FileHeader, stack_bound), X(FileHeader, geometry_count), X(FileHeader, bounds),    \
      X(FileHeader, primitive_count), X(FileHeader, levels), X(FileHeader, condition), X(FileHeader, reach),    \
      X(FileHeader, shutter_begin), X(FileHeader, shutter_rate), X(FileHeader, box_margin), X(FileHeader, reserved)
#define ENTRY(X)                                                                                  \
  X(SectionEntry, kind), X(SectionEntry, flags), X(SectionEntry, offset), X(SectionEntry, count), \
      X(SectionEntry, stride)
#define GEOMETRY(X)                                                                                         \
  X(GeometryRecord, first_primitive), X(GeometryRecord, primitive_count), X(GeometryRecord, dropped_count), \
      X(GeometryRecord, mask), X(GeometryRecord, flags)
#define INSTANCE(X)                                                                                              \
  X(InstanceRecord, linear), X(InstanceRecord, translation), X(InstanceRecord, object), X(InstanceRecord, mask), \
      X(InstanceRecord, id), X(InstanceRecord, flags)
#define OBJECT(X)                                                                                               \
  X(ObjectRecord, offset), X(ObjectRecord, size), X(ObjectRecord, geometries), X(ObjectRecord, instances),      \
      X(ObjectRecord, features), X(ObjectRecord, bounds), X(ObjectRecord, root), X(ObjectRecord, condition),    \
      X(ObjectRecord, reach), X(ObjectRecord, stack_bound), X(ObjectRecord, levels), X(ObjectRecord, reserved), \
      X(ObjectRecord, motions)
#define MOTION(X)                                                                                      \
  X(MotionRecord, segments), X(MotionRecord, count), X(MotionRecord, kind), X(MotionRecord, rounding), \
      X(MotionRecord, farthest), X(MotionRecord, reserved)
#define SEGMENT(X) \
  X(MotionSegment, time), X(MotionSegment, translation), X(MotionSegment, turning), X(MotionSegment, reserved)
#define SHAPE(X)                                                                                       \
  X(ShapeRecord, points), X(ShapeRecord, segments), X(ShapeRecord, point_count), X(ShapeRecord, kind), \
      X(ShapeRecord, keys), X(ShapeRecord, reserved)
#define POINT(X) X(ShapePoint, position), X(ShapePoint, radius)
#define TURNING(X) X(TurningSegment, rotation), X(TurningSegment, angle), X(TurningSegment, stretch)
  return {{"FileHeader", sizeof(FileHeader), sum({HEADER(SIZE)}), {HEADER(FIELD)}},
          {"SectionEntry", sizeof(SectionEntry), sum({ENTRY(SIZE)}), {ENTRY(FIELD)}},
          {"GeometryRecord", sizeof(GeometryRecord), sum({GEOMETRY(SIZE)}), {GEOMETRY(FIELD)}},
          {"InstanceRecord", sizeof(InstanceRecord), sum({INSTANCE(SIZE)}), {INSTANCE(FIELD)}},
          {"ObjectRecord", sizeof(ObjectRecord), sum({OBJECT(SIZE)}), {OBJECT(FIELD)}},
          {"MotionRecord", sizeof(MotionRecord), sum({MOTION(SIZE)}), {MOTION(FIELD)}},
          {"MotionSegment", sizeof(MotionSegment), sum({SEGMENT(SIZE)}), {SEGMENT(FIELD)}},
          {"ShapeRecord", sizeof(ShapeRecord), sum({SHAPE(SIZE)}), {SHAPE(FIELD)}},
          {"ShapePoint", sizeof(ShapePoint), sum({POINT(SIZE)}), {POINT(FIELD)}},
          {"TurningSegment", sizeof(TurningSegment), sum({TURNING(SIZE)}), {TURNING(FIELD)}}};
}

std::vector<RecordSpec> node_records() {
#define FLOAT_NODE(X) \
  X(FloatBoxNode, child), X(FloatBoxNode, box), X(FloatBoxNode, child_flags), X(FloatBoxNode, reserved)
#define PLANES_NODE(X) \
  X(PlanesBoxNode, child), X(PlanesBoxNode, plane), X(PlanesBoxNode, child_flags), X(PlanesBoxNode, reserved)
#define FLOAT_LEAF(X) X(FloatLeaf, vertex), X(FloatLeaf, info)
#define PLANES_LEAF(X) X(PlanesLeaf, coordinate), X(PlanesLeaf, info)
#define LEAF_INFO(X) X(LeafInfo, primitive), X(LeafInfo, geometry_and_flags), X(LeafInfo, triangle_ids)
#define BOX(X) X(Box, min), X(Box, max)
#define HALF_NODE(X) X(HalfBoxNode, child), X(HalfBoxNode, box)
#define HALF_BOX(X) X(HalfBoxNode::HalfBox, min), X(HalfBoxNode::HalfBox, max)
#define QUANTIZED_NODE(X)                                                                       \
  X(QuantizedBoxNode, origin), X(QuantizedBoxNode, exponent), X(QuantizedBoxNode, children),    \
      X(QuantizedBoxNode, child), X(QuantizedBoxNode, plane), X(QuantizedBoxNode, child_flags), \
      X(QuantizedBoxNode, reserved)
#define CUSTOM_LEAF(X) X(CustomLeaf, box), X(CustomLeaf, info)
  return {{"Box", sizeof(Box), sum({BOX(SIZE)}), {BOX(FIELD)}},
          {"FloatBoxNode", sizeof(FloatBoxNode), sum({FLOAT_NODE(SIZE)}), {FLOAT_NODE(FIELD)}},
          {"PlanesBoxNode", sizeof(PlanesBoxNode), sum({PLANES_NODE(SIZE)}), {PLANES_NODE(FIELD)}},
          {"HalfBoxNode", sizeof(HalfBoxNode), sum({HALF_NODE(SIZE)}), {HALF_NODE(FIELD)}},
          {"HalfBox", sizeof(HalfBoxNode::HalfBox), sum({HALF_BOX(SIZE)}), {HALF_BOX(FIELD)}},
          {"QuantizedBoxNode", sizeof(QuantizedBoxNode), sum({QUANTIZED_NODE(SIZE)}), {QUANTIZED_NODE(FIELD)}},
          {"CustomLeaf", sizeof(CustomLeaf), sum({CUSTOM_LEAF(SIZE)}), {CUSTOM_LEAF(FIELD)}},
          {"FloatLeaf", sizeof(FloatLeaf), sum({FLOAT_LEAF(SIZE)}), {FLOAT_LEAF(FIELD)}},
          {"PlanesLeaf", sizeof(PlanesLeaf), sum({PLANES_LEAF(SIZE)}), {PLANES_LEAF(FIELD)}},
          {"LeafInfo", sizeof(LeafInfo), sum({LEAF_INFO(SIZE)}), {LEAF_INFO(FIELD)}}};
}

struct Constant {
  std::uint64_t value;
  std::string name;
};
#define CONSTANT(scope, name) \
  Constant { static_cast<std::uint64_t>(scope::name), #name }

std::map<std::string, std::vector<Constant>> constant_tables() {
  return {{"Section kinds",
           {CONSTANT(SectionKind, kNodes), CONSTANT(SectionKind, kLeaves), CONSTANT(SectionKind, kPrimitiveMap),
            CONSTANT(SectionKind, kGeometries), CONSTANT(SectionKind, kProvenance), CONSTANT(SectionKind, kInstances),
            CONSTANT(SectionKind, kObjects), CONSTANT(SectionKind, kObjectFiles), CONSTANT(SectionKind, kMotions),
            CONSTANT(SectionKind, kMotionSegments), CONSTANT(SectionKind, kShapes), CONSTANT(SectionKind, kShapePoints),
            CONSTANT(SectionKind, kCurveSegments), CONSTANT(SectionKind, kObjectShapes)}},
          {"Feature bits",
           {CONSTANT(Feature, kTriangles), CONSTANT(Feature, kMasks), CONSTANT(Feature, kSplitReferences),
            CONSTANT(Feature, kCustom), CONSTANT(Feature, kInstances), CONSTANT(Feature, kMotion),
            CONSTANT(Feature, kMovingBoxes), CONSTANT(Feature, kWidenedBoxes)}},
          {"Shape kinds",
           {CONSTANT(ShapeKind, kNone), CONSTANT(ShapeKind, kSpheres), CONSTANT(ShapeKind, kCurves),
            CONSTANT(ShapeKind, kMovingTriangles)}},
          {"Motion kinds", {CONSTANT(MotionKind, kSlerp), CONSTANT(MotionKind, kNlerp), CONSTANT(MotionKind, kMatrix)}},
          {"Instance flags", {CONSTANT(InstanceFlags, kNoFilter)}},
          {"Geometry flags", {CONSTANT(hiprt, kGeometryCustom), {0xffffff00, "geometry_type"}}},
          {"Children byte", {{0x0f, "children_mask"}, {0x30, "children_order_axis"}}},
          {"Node types",
           {CONSTANT(NodeType, kTriangle0), CONSTANT(NodeType, kTriangle1), CONSTANT(NodeType, kTriangle2),
            CONSTANT(NodeType, kTriangle3), CONSTANT(NodeType, kBox16), CONSTANT(NodeType, kBox32),
            CONSTANT(NodeType, kInstance), CONSTANT(NodeType, kProcedural)}},
          {"Layouts",
           {CONSTANT(NodeLayout, kFloat), CONSTANT(NodeLayout, kPlanes), CONSTANT(NodeLayout, kHalf),
            CONSTANT(NodeLayout, kQuantized)}},
          {"Child flags",
           {CONSTANT(hiprt, kChildOnlyOpaque), CONSTANT(hiprt, kChildOnlyNonOpaque),
            CONSTANT(hiprt, kChildOnlyTriangles), CONSTANT(hiprt, kChildOnlyProcedural)}},
          {"Triangle-id bits",
           {{0x03, "u_source"},
            {0x0c, "v_source"},
            CONSTANT(TriangleId, kDoubleSided),
            CONSTANT(TriangleId, kFlip),
            CONSTANT(TriangleId, kProcedural),
            CONSTANT(TriangleId, kOpaque)}}};
}

}  // namespace

TEST_CASE("record tables of FORMAT.md and the records agree") {
  const auto tables = read_tables();
  auto records = container_records();
  for (auto& record : node_records()) records.push_back(record);
  std::size_t tables_of_records = 0;
  for (const auto& [heading, rows] : tables) tables_of_records += heading.find(" bytes") != std::string::npos ? 1 : 0;
  CHECK(tables_of_records == records.size());
  for (const RecordSpec& record : records) {
    const auto table = tables.find(record.heading + ": " + std::to_string(record.size) + " bytes");
    INFO(record.heading << ", " << record.size << " bytes");
    REQUIRE(table != tables.end());
    std::vector<std::string> rows;
    for (const Row& row : table->second) {
      REQUIRE(row.size() >= 3);
      rows.push_back(row[0] + " " + row[1] + " " + row[2]);
    }
    CHECK(rows == record.fields);
    // Every field is in the list above, and so in the specification, iff the list leaves no byte over.
    CHECK(record.field_bytes == record.size);
  }
}

TEST_CASE("constant tables of FORMAT.md and the constants agree") {
  const auto tables = read_tables();
  for (const auto& [heading, constants] : constant_tables()) {
    INFO(heading);
    REQUIRE(tables.count(heading) == 1);
    const std::vector<Row>& rows = tables.at(heading);
    REQUIRE(rows.size() == constants.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      REQUIRE(rows[i].size() >= 2);
      CHECK(std::stoull(rows[i][0], nullptr, 0) == constants[i].value);
      CHECK(rows[i][1] == constants[i].name);
    }
  }
}

TEST_CASE("numbers in FORMAT.md's text are the code's") {
  CHECK(TriangleId::from_rotation(0) == 0x89);
  CHECK(TriangleId::from_rotation(1) == 0x84);
  CHECK(TriangleId::from_rotation(2) == 0x82);
  for (unsigned rotation = 0; rotation < 3; ++rotation) {
    // Stored corner k is the mesh's corner (k + rotation) % 3.
    const std::uint32_t id = TriangleId::from_rotation(rotation);
    CHECK((TriangleId::u_source(id) + rotation) % 3 == 1);
    CHECK((TriangleId::v_source(id) + rotation) % 3 == 2);
  }
  CHECK(kAddressLimit == (std::uint64_t{1} << 35) - 64);
  CHECK(make_ref(kAddressLimit - 64, NodeType::kProcedural) != kInvalidRef);
  CHECK(make_ref(kAddressLimit, NodeType::kProcedural) == kInvalidRef);
  CHECK(kMaxGeometries == std::uint64_t{1} << 28);
  CHECK(kMaxSections == 64);
  CHECK(kSectionAlignment == 128);
  CHECK(kBufferAlignment == 256);
  CHECK(kKnownFeatures == 255);
  CHECK(kMaxCondition == std::ldexp(1.0f, 40));
  CHECK(kInstanceStackEntries == 3);
  CHECK(kVersionMajor == 1);
  CHECK(kVersionMinor == 8);
  CHECK(TriangleId::kCustom == 0xc0);
  CHECK(custom_geometry_flags(kMaxGeometryType) == 0xffffff01u);
  CHECK(mesh_flags(kMaxGeometryType) == 0xffffff00u);
  CHECK(geometry_type(0xabcdef01u) == 0xabcdef);
  CHECK(children_mask(0x2d) == 0xd);
  CHECK(children_order_axis(0x2d) == 2);
  CHECK(kHalfInfinity == 0x7c00);
  CHECK(kHalfNegativeInfinity == 0xfc00);
  CHECK(kQuantizedLimit == std::ldexp(1.0f, 126));
  CHECK(node_size(NodeLayout::kFloat) == 128);
  CHECK(node_size(NodeLayout::kPlanes) == 128);
  CHECK(node_size(NodeLayout::kHalf) == 64);
  CHECK(node_size(NodeLayout::kQuantized) == 64);
  for (std::uint32_t type = 0; type < 8; ++type) CHECK(is_box(type) == (type == 4 || type == 5));
  CHECK_FALSE(is_box(kInvalidRef));
}
