#include <hiprt_build/format/error.h>

#include <bit>
#include <cinttypes>
#include <cstdio>
#include <iterator>
#include <string_view>

namespace hiprt {

namespace {

/// Placeholders of a sentence: {found} and {limit} are FormatIssue's value and limit; {found:x} and {limit:x} are
/// hexadecimal.
struct Text {
  const char* name;
  const char* sentence;
  const char* if_more = "";  ///< Appended if the value is larger than the limit.
  const char* if_less = "";  ///< Appended if it is smaller.
};

/// In the order of FormatError.
constexpr Text kTexts[] = {
    {"Misaligned", "the bytes start {found} bytes after a multiple of 128 in memory; they must start at a multiple"},
    {"TooSmall", "{found} bytes, but the header alone has {limit}: this is not a BVH file, or it is truncated"},
    {"BadMagic", "the first byte or a later one of the magic number is wrong: this is not a BVH file"},
    {"UnknownMajorVersion",
     "format version {found}, but this library reads version {limit}: build the file again with this version's "
     "bvhbuild"},
    {"UnknownLayout", "node layout {found} is unknown; the largest known number is {limit}"},
    {"UnknownFeature",
     "the feature bits are {found:x}, but this library knows {limit:x}: a newer library wrote the file"},
    {"SizeMismatch", "{limit} bytes, but its header says {found}: ", "the file is truncated",
     "bytes were added at the end"},
    {"BadReservedField", "a reserved field or padding byte is {found:x}; only bits of {limit:x} may be set"},
    {"SectionTableRange", "the section table has {found} entries; at most {limit} fit"},
    {"SectionMisaligned", "a section starts at byte {found}, which is not a multiple of {limit}"},
    {"SectionStride", "the records of a section have {found} bytes; expected {limit}"},
    {"SectionRange",
     "a section leaves the file: its offset or record count is {found}, the largest possible is {limit}"},
    {"SectionOverlap", "the section at byte {found} overlaps the section table or the section at byte {limit}"},
    {"DuplicateSection", "section kind {found} occurs more than once"},
    {"MissingSection", "section kind {found} is missing, or it occurs without the sections that belong to it"},
    {"UnknownRequiredSection", "section kind {found} is required to read the file, and this library does not know it"},
    {"GeometryCount",
     "{found} geometries; expected {limit} (a scene of instances has one custom geometry of type 0 that every ray "
     "sees)"},
    {"PrimitiveCount",
     "a primitive count or a first primitive is {found}; expected {limit}, or for the count of one geometry at most "
     "that"},
    {"BadChecksum",
     "the header states checksum {found:x}, but the bytes have {limit:x}: the file was changed or damaged"},
    {"BadReference",
     "node reference {found:x} is invalid: its type is not one of this file, or it names no record of its section"},
    {"ReferenceOrder",
     "a child node starts at byte {found}; children lie behind their parent, here from byte {limit} on"},
    {"SharedNode", "the node or leaf at byte {found} is reached more than once"},
    {"EmptyNode", "a box node has no children"},
    {"BadChildSlots",
     "the children byte of a quantized node is {found:x}: its low four bits must name the children that exist, the "
     "next two an axis from 0 to 2"},
    {"BadGrid",
     "the origin or the exponent of a quantized node is {found}; the largest is {limit}, and exponents start at 1"},
    {"InexactPlane", "quantized plane {found} does not decode to a float, or to one of more than 2^126"},
    {"Unreachable", "record {found} of {limit} is not reached from the root"},
    {"BadBox",
     "a box plane is {found}, compared with {limit}: used boxes must be finite with min <= max, unused boxes empty"},
    {"BoxNotContained", "a plane or vertex at {found} lies outside the enclosing box, whose plane is at {limit}"},
    {"BadBounds",
     "a plane of the header's bounds is {found}, compared with {limit}: the bounds must be finite and the root's"},
    {"BadChildFlags", "the child flags are {found:x}; expected {limit:x}"},
    {"UnterminatedRun", "a run of {found} leaves reaches the end of the section of {limit} leaves without a last leaf"},
    {"BadVertex",
     "a vertex coordinate is {found}, compared with {limit}: it must be finite, and vertex 3 of a single triangle "
     "must repeat vertex 2"},
    {"BadGeometryId",
     "geometry number {found} is not below {limit}, or the geometry is not of the leaf's kind (triangles or custom)"},
    {"BadPrimitiveId", "primitive number {found}, but the geometry has {limit} primitives"},
    {"BadTriangleId", "a triangle-id byte is {found:x}; expected {limit:x}, or another rotation of a triangle"},
    {"SplitWithoutFeature",
     "primitive {found} is in several leaves, but the header does not say that primitives are split"},
    {"SplitDiffers", "two leaves of a split primitive have different vertices: coordinates {found} and {limit}"},
    {"SplitNotCovered", "the boxes of a split primitive's leaves end at {found}, but the primitive reaches {limit}"},
    {"SplitCustom", "custom primitive {found} is in several leaves"},
    {"PrimitiveMapMismatch",
     "an entry of the primitive map is {found}: it must name a leaf slot with the primitive, or be 4294967295 if no "
     "leaf has it"},
    {"DroppedCount", "a geometry's record counts {found} dropped primitives, but {limit} are in no leaf"},
    {"FeatureMismatch", "the header's feature bits are {found:x}; the content has {limit:x}"},
    {"StackBound", "the header's stack bound is {found}, compared with {limit}: ",
     "no tree of this size needs more entries than that", "a traversal may need that many entries"},
    {"BadProvenance", "the provenance is not a JSON object in UTF-8: it has the byte {found:x}"},
    {"BadLevels", "the header says {found} levels of instances; expected {limit}"},
    {"BadTransformBound", "the header's condition or reach is {found}; the instances need {limit}, as a finite number"},
    {"BadObject", "a field of an object record is {found}; its file or its section requires {limit}"},
    {"BadInstance",
     "an instance has {found}, compared with {limit}: it must have an object before its own, enter all parts of it "
     "once, and be finite and invertible"},
    {"InstanceLeaf", "the flags of a leaf of instances are {found:x}; expected {limit:x}: it must be alone in its run"},
    {"BadMotion",
     "a motion has {found}, compared with {limit}: keys must be finite, ordered, invertible, within the header's "
     "shutter and in their section"},
    {"BadShape",
     "a shape has {found}, compared with {limit}: points must be finite, as many as the primitives need, and in their "
     "section"},
    {"BadBoxMargin",
     "the header says {found} for the margin of the boxes: it must be positive and finite in a file with widened "
     "boxes, and "
     "{limit} in others"},
};
static_assert(std::size(kTexts) == kFormatErrors);

std::string number_text(std::uint64_t bits, NumberKind kind, bool hexadecimal) {
  char text[32];
  if (kind == NumberKind::kFloat)
    std::snprintf(text, sizeof(text), "%.9g",
                  static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits))));
  else if (kind == NumberKind::kDouble)
    std::snprintf(text, sizeof(text), "%.17g", std::bit_cast<double>(bits));
  else
    std::snprintf(text, sizeof(text), hexadecimal ? "0x%" PRIx64 : "%" PRIu64, bits);
  return text;
}

std::string filled_in(std::string_view sentence, const FormatIssue& issue) {
  std::string text;
  for (std::size_t at = 0; at < sentence.size();) {
    const std::size_t open = sentence.find('{', at);
    text += sentence.substr(at, open - at);
    if (open == std::string_view::npos) break;
    const std::size_t close = sentence.find('}', open);
    const std::string_view field = sentence.substr(open + 1, close - open - 1);
    const std::uint64_t value = field.front() == 'f' ? issue.value : issue.limit;
    text += number_text(value, issue.number, field.ends_with(":x"));
    at = close + 1;
  }
  return text;
}

}  // namespace

const char* name(FormatError error) { return kTexts[static_cast<std::size_t>(error)].name; }

std::string to_string(const FormatIssue& issue) {
  const Text& text = kTexts[static_cast<std::size_t>(issue.error)];
  return filled_in(text.sentence, issue) + (issue.value > issue.limit ? text.if_more : text.if_less) + " (byte " +
         std::to_string(issue.offset) + ", " + name(issue.error) + ")";
}

}  // namespace hiprt
