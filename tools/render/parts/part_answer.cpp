#include <tools/render/parts/part_answer.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>
#include <tools/render/parts/ray_mail.h>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

namespace hiprt::tools {
namespace {

/// A ray in a message. tmin and mask are left out: they are 0 and all bits.
struct RayRecord {
  Vec3 origin;
  float tmax;
  Vec3 direction;
  float time;
};
static_assert(sizeof(RayRecord) == kQuestionRayBytes && std::is_trivially_copyable_v<RayRecord>);
static_assert(std::is_trivially_copyable_v<PartHit> && sizeof(PartHit) == 36 + 36 + 8 + 8);

// The kinds of answers.
constexpr std::uint8_t kClosestAnswer = 0, kAnyAnswer = 1, kFault = 2;

tl::unexpected<build::Error> malformed(const char* what, std::size_t size) {
  return invalid_input(std::string(what) + " of a part is malformed (" + std::to_string(size) + " bytes)");
}

}  // namespace

std::vector<std::byte> encode(const PartQuestion& question) {
  ByteWriter writer;
  writer.add(question.part);
  writer.add(question.slot);
  writer.add(question.number);
  writer.add(std::uint32_t{question.query == Query::kAny});
  std::vector<RayRecord> rays;
  rays.reserve(question.rays.size());
  for (const Ray& ray : question.rays) rays.push_back({ray.origin, ray.tmax, ray.direction, ray.time});
  writer.add_array(std::span(std::as_const(rays)));
  return std::move(writer.bytes());
}

build::Result<PartQuestion> decode_question(std::span<const std::byte> bytes, std::size_t parts) {
  ByteReader reader(bytes);
  PartQuestion question{reader.get<std::uint32_t>(),
                        reader.get<std::uint32_t>(),
                        reader.get<std::uint32_t>(),
                        reader.get<std::uint32_t>() != 0 ? Query::kAny : Query::kClosest,
                        {}};
  for (const RayRecord& record : reader.get_array<RayRecord>()) {
    Ray& ray = question.rays.emplace_back();
    ray.origin = record.origin;
    ray.tmax = record.tmax;
    ray.direction = record.direction;
    ray.time = record.time;
  }
  if (!reader.ok() || !reader.at_end() || question.part >= parts || question.slot >= RayMail::kMostSlots)
    return malformed("a question", bytes.size());
  return question;
}

std::vector<std::byte> encode(std::uint32_t number, const PartAnswer& answer) {
  ByteWriter writer;
  writer.add(number);
  writer.add(answer.query == Query::kClosest ? kClosestAnswer : kAnyAnswer);
  writer.add_array(std::span(answer.results));
  if (answer.query == Query::kClosest) {
    writer.add_array(std::span(answer.hits));
    writer.add_array(std::span(answer.paths));
  }
  return std::move(writer.bytes());
}

std::vector<std::byte> encode_fault(std::uint32_t number, const build::Error& error) {
  ByteWriter writer;
  writer.add(number);
  writer.add(kFault);
  writer.add(error.code);
  writer.add_text(error.message);
  return std::move(writer.bytes());
}

build::Result<NumberedAnswer> decode_answer(std::span<const std::byte> bytes, std::uint32_t levels) {
  ByteReader reader(bytes);
  NumberedAnswer result{reader.get<std::uint32_t>(), {}};
  const auto kind = reader.get<std::uint8_t>();
  if (kind == kFault) {
    const auto code = reader.get<build::ErrorCode>();
    std::string message = reader.get_text();
    if (!reader.ok()) return malformed("an answer", bytes.size());
    return fail(code, std::move(message));
  }
  PartAnswer& answer = result.answer;
  answer.query = kind == kAnyAnswer ? Query::kAny : Query::kClosest;
  answer.results = reader.get_array<VisitResult>();
  if (kind == kClosestAnswer) {
    answer.hits = reader.get_array<PartHit>();
    answer.paths = reader.get_array<std::uint32_t>();
  }
  const auto is_known = [](VisitResult visit) { return visit <= VisitResult::kFailed; };
  const auto found = std::count(answer.results.begin(), answer.results.end(), VisitResult::kHit);
  const bool fits = kind == kAnyAnswer || (static_cast<std::size_t>(found) == answer.hits.size() &&
                                           answer.paths.size() == answer.hits.size() * levels);
  if (!reader.ok() || !reader.at_end() || kind > kAnyAnswer || !fits ||
      !std::all_of(answer.results.begin(), answer.results.end(), is_known))
    return malformed("an answer", bytes.size());
  return result;
}

}  // namespace hiprt::tools
