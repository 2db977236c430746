#include <hiprt_build/format/error.h>

#include <bit>
#include <cstdio>
#include <iterator>
#include <string_view>

namespace hiprt {

namespace {

/// Placeholders of a sentence: {found} and {limit} as integers, {found:f} and {limit:f} as floats of these bits.
struct Text {
  const char* name;
  const char* sentence;
};

/// In the order of FormatError.
constexpr Text kTexts[] = {
    {"Misaligned",
     "the bytes start {found} bytes after a multiple of 128 in memory; they must start at a multiple of 128"},
    {"TooSmall", "{found} bytes, but the header alone has {limit}: this is not a BVH file, or it is truncated"},
    {"BadMagic", "the file does not start with the magic number of BVH files: this is not a BVH file"},
    {"UnknownMajorVersion",
     "format version {found}, but this library reads version {limit}: build the file again with this version's "
     "bvhbuild"},
    {"UnknownLayout", "unknown node layout {found}; layouts have the numbers up to {limit}"},
    {"UnknownFeature", "feature bits {found}, but this library knows {limit} only: a newer library wrote the file"},
    {"SizeMismatch", "{limit} bytes, but its header says {found}: "},
    {"BadReservedField", "a reserved field or padding is {found}; allowed are bits of {limit}"},
    {"SectionTableRange", "{found} sections, but there is room for {limit}"},
    {"SectionMisaligned", "a section starts at byte {found}, which is no multiple of {limit}"},
    {"SectionStride", "the records of a section have {found} bytes; expected are {limit}"},
    {"SectionRange", "a section leaves the file: {found} is more than {limit}"},
    {"SectionOverlap", "the section at byte {found} overlaps what lies at or before byte {limit}"},
    {"DuplicateSection", "section kind {found} occurs twice"},
    {"MissingSection", "there is no section of kind {found}"},
    {"UnknownRequiredSection", "section kind {found} is required to read the file, and this library does not know it"},
    {"GeometryCount", "{found} geometries; expected are {limit}"},
    {"PrimitiveCount", "a primitive count or first primitive is {found}; expected is {limit}"},
    {"BadChecksum", "the header states checksum {found}, but the bytes have {limit}: the file was changed or damaged"},
    {"BadReference",
     "node reference {found} has an unknown type, is no record's, or leaves its section (limit {limit})"},
    {"ReferenceOrder", "a child at byte {found} lies before byte {limit}: the tree could loop"},
    {"SharedNode", "the record at byte {found} is reached more than once"},
    {"EmptyNode", "a box node has no children"},
    {"BadChildSlots", "the children byte is {found}; its references ask for {limit}"},
    {"BadGrid", "the grid of a quantized node has {found}; the limit is {limit}"},
    {"InexactPlane", "quantized plane {found} is not exactly a float"},
    {"Unreachable", "record {found} of {limit} is not reached from the root"},
    {"BadBox", "a box plane is {found:f}; expected is {limit:f}, or a finite box with min <= max"},
    {"BoxNotContained", "a box plane at {found:f} lies outside its parent's plane at {limit:f}"},
    {"BadBounds", "a plane of the file's bounds is {found:f}; its tree has {limit:f}"},
    {"BadChildFlags", "child flags {found}; expected are {limit}"},
    {"UnterminatedRun", "a run of leaves does not end in its section of {limit} leaves"},
    {"BadVertex", "a vertex coordinate is {found:f}, which is not finite"},
    {"BadGeometryId", "geometry number {found}; the limit is {limit}"},
    {"BadPrimitiveId", "primitive number {found}; the limit is {limit}"},
    {"BadTriangleId", "triangle id bits {found}; expected are {limit}"},
    {"SplitWithoutFeature",
     "primitive {found} is in several leaves, but the header does not say that primitives are split"},
    {"SplitDiffers", "the leaves of split primitive {found} have different vertices"},
    {"SplitNotCovered", "the boxes of the leaves of split primitive {found} do not cover it"},
    {"SplitCustom", "custom primitive {found} is in several leaves"},
    {"PrimitiveMapMismatch", "the primitive map has {found}; the leaves have {limit}"},
    {"DroppedCount", "the header counts {found} dropped primitives; in no leaf are {limit}"},
    {"FeatureMismatch", "feature bits {found}; the content has {limit}"},
    {"StackBound", "a stack bound of {found} entries; the tree asks for {limit}"},
    {"BadProvenance", "the provenance block is no JSON object in UTF-8: byte value {found}"},
    {"BadLevels", "{found} levels of instances; expected are {limit}"},
    {"BadTransformBound", "a bound of the transforms is {found:f}; they need {limit:f}"},
    {"BadObject", "an object record has {found}; its file or section asks for {limit}"},
    {"BadInstance",
     "an instance has {found}; allowed is what its object has (limit {limit}) and an invertible, finite transform"},
    {"InstanceLeaf", "a leaf of instances has {found}; each must be alone in its run ({limit})"},
    {"BadMotion",
     "a motion has {found}; its keys must be finite, in order, invertible and in their section (limit {limit})"},
    {"BadShape",
     "a shape has {found}; its points must be finite, as many as its primitives, and in their section (limit {limit})"},
};
static_assert(std::size(kTexts) == kFormatErrors);

std::string float_text(std::uint64_t bits) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g",
                static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits))));
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
    text += field.ends_with(":f") ? float_text(value) : std::to_string(value);
    at = close + 1;
  }
  return text;
}

}  // namespace

const char* name(FormatError error) { return kTexts[static_cast<std::size_t>(error)].name; }

std::string to_string(const FormatIssue& issue) {
  std::string text = filled_in(kTexts[static_cast<std::size_t>(issue.error)].sentence, issue);
  if (issue.error == FormatError::kSizeMismatch)
    text += issue.value > issue.limit ? "the file is truncated" : "bytes were added at the end";
  return text + " (byte " + std::to_string(issue.offset) + ", " + name(issue.error) + ")";
}

}  // namespace hiprt
