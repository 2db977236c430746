// Invalid motions, one fault each, where other faults could hide the check: the file breaks one rule only.

#include "bad_files.h"
#include "good_parts.h"

#include <hiprt_build/format/view.h>

#include <limits>

namespace hiprt::test {

namespace {

/// The words of a MotionSegment that turns.
constexpr unsigned kTime = 0, kTranslation = 2, kFirstRotation = 8, kLastRotation = 12, kAngle = 16, kFirstStretch = 17,
                   kLastStretch = 23, kUnusedByMatrices = 26;

struct Word {
  unsigned number;
  float value;
};

std::uint64_t word_at(const BufferView& view, unsigned segment, unsigned word) {
  return view.segment_entry.offset + segment * sizeof(MotionSegment) + 4 * word;
}

/// @param bad the word that the report must name.
BadCase words(const char* what, TestFile (*good)(NodeLayout), const std::vector<Word>& changes, unsigned bad,
              unsigned segment = 0) {
  return {FormatError::kBadMotion, what, [=](NodeLayout layout) {
            TestFile file = good(layout);
            const BufferView view = *open_buffer(file.bytes());
            for (const Word& word : changes) file.put(word_at(view, segment, word.number), word.value);
            const std::uint64_t at = word_at(view, segment, bad);
            file.seal();
            return BadFile{std::move(file), at};
          }};
}

/// @param fault changes the file and returns the byte that the report must name.
BadCase moving_fault(FormatError error, const char* what, TestFile (*good)(NodeLayout),
                     const std::function<std::uint64_t(TestFile&, const BufferView&)>& fault) {
  return {error, what, [=](NodeLayout layout) {
            TestFile file = good(layout);
            const BufferView view = *open_buffer(file.bytes());
            const std::uint64_t at = fault(file, view);
            file.seal();
            return BadFile{std::move(file), at};
          }};
}

std::vector<BadCase> rotation_cases() {
  const auto last = [](float x, float y, float z, float w) {
    return std::vector<Word>{
        {kLastRotation, x}, {kLastRotation + 1, y}, {kLastRotation + 2, z}, {kLastRotation + 3, w}};
  };
  return {
      words("an arc of no angle to its first quaternion", slerp_file, last(0, 0, 0, 1), kLastRotation),
      words("an arc that comes from behind", slerp_file, last(0, 0, 0, -1), kLastRotation),
      words("quaternions on opposite sides", nlerp_file, last(0, 0, 0, -1), kLastRotation),
      words("a first quaternion too short", slerp_file, {{kFirstRotation + 3, 0.75f}}, kFirstRotation),
      words("a last quaternion too long", nlerp_file, last(0, 0, 0, 1.25f), kLastRotation),
      words("an angle where quaternions are interpolated", nlerp_file, {{kAngle, 0.5f}}, kAngle),
      words("an angle beyond a right one", slerp_file, {{kAngle, 1.5708f}}, kAngle),
  };
}

std::vector<BadCase> stretch_cases() {
  return {
      words("no scale at the first key", slerp_file, {{kFirstStretch, 0.0f}}, kLastStretch),
      words("no scale at the last key", slerp_file, {{kLastStretch + 2, 0.0f}}, kLastStretch + 2),
      words("another sign of a scale", slerp_file, {{kLastStretch + 1, -1.0f}}, kLastStretch + 1),
      words("shear without scale hides nothing", hidden_first_file, {{kFirstStretch + 3, 1.0f}}, kLastStretch),
      words("no scale behind a key that hides", hidden_first_file, {{kLastStretch + 1, 0.0f}}, kLastStretch + 1),
      words("no scale before a key that hides", hidden_last_file, {{kFirstStretch + 2, 0.0f}}, kFirstStretch + 2),
  };
}

std::vector<BadCase> word_cases() {
  constexpr float kMax = std::numeric_limits<float>::max();
  return {
      words("an infinite translation", slerp_file, {{kTranslation + 4, kInf}}, kTranslation + 4),
      words("a NaN stretch", slerp_file, {{kLastStretch, std::numeric_limits<float>::quiet_NaN()}}, kLastStretch),
      words("a number behind a matrix", matrix_file, {{kUnusedByMatrices, 1.0f}}, kUnusedByMatrices),
      words("a segment without length", slerp_file, {{kTime + 1, 1.0f}}, kTime + 1, 1),
      words("a segment longer than a float", slerp_file, {{kTime, -kMax}, {kTime + 1, kMax}}, kTime + 1),
      words("a segment that begins before the last one ends", slerp_file, {{kTime, 0.5f}}, kTime, 1),
      moving_fault(FormatError::kBadMotion, "a shutter that ends just before the last key", slerp_file,
                   [](TestFile& file, const BufferView& view) {
                     file.put(offsetof(FileHeader, shutter_rate), (1 + 0x1p-20f) * view.header->shutter_rate);
                     return offsetof(FileHeader, shutter_rate);
                   }),
      moving_fault(FormatError::kBadMotion, "NaN in the place of the farthest translation", slerp_file,
                   [](TestFile& file, const BufferView& view) {
                     const std::uint64_t at =
                         view.motion_entry.offset + sizeof(MotionRecord) + offsetof(MotionRecord, farthest);
                     file.put(at, std::numeric_limits<float>::quiet_NaN());
                     return at;
                   }),
  };
}

/// A sliding instance whose boxes have less room for rounding on one side: 8 units of 15, and 12 are
/// needed.
/// @param plane of Box: 0 to 5.
BadCase without_room(const char* what, unsigned plane) {
  return moving_fault(FormatError::kBoxNotContained, what, plane < 3 ? sliding_back_file : sliding_file,
                      [=](TestFile& file, const BufferView& view) {
                        const std::uint64_t at = view.leaves.offset + 4 * plane;
                        const float begin = file.get<float>(at), end = file.get<float>(at + sizeof(Box));
                        const float less = 7 * 0x1p-24f * end;
                        file.put(at, begin - less);
                        file.put(at + sizeof(Box), end - less);
                        return at;
                      });
}

std::vector<BadCase> moving_box_cases() {
  using E = FormatError;
  const auto begin_is_nan = [](TestFile& file, const BufferView& view) {
    const std::uint64_t at = view.leaves.offset + 8;
    file.put(at, std::numeric_limits<float>::quiet_NaN());
    return at;
  };
  return {
      without_room("a moving box without its room below", 0),
      without_room("a moving box without its room above", 3),
      moving_fault(E::kBadBox, "a NaN box at the begin", sliding_file, begin_is_nan),
      // The leaf's own boxes are right.
      moving_fault(E::kBoxNotContained, "bounds of all times that the instance leaves", sliding_file,
                   [](TestFile& file, const BufferView& view) {
                     const std::uint64_t at = offsetof(FileHeader, bounds) + 12;
                     file.put(at, file.get<float>(at) - 0.25f);
                     return view.leaves.offset;
                   }),
  };
}

}  // namespace

std::vector<BadCase> one_motion_fault_cases() {
  std::vector<BadCase> all;
  for (auto* part : {rotation_cases, stretch_cases, word_cases, moving_box_cases})
    for (BadCase& bad : part()) all.push_back(std::move(bad));
  return all;
}

}  // namespace hiprt::test
