#include <tools/cli/ranks/rank_mail.h>

#include <tools/base/errors.h>
#include <tools/cli/ranks/rank_crew.h>

#include <utility>

namespace hiprt::tools {

static_assert(RenderTag::kAnswer + RayMail::kMostSlots < 900, "deal.h has the tags from 900 on");

void RankMail::ask(unsigned rank, std::vector<std::byte> question) {
  ranks_.send(static_cast<int>(rank), RenderTag::kQuestion, std::move(question));
}

void RankMail::answer(unsigned rank, unsigned slot, std::vector<std::byte> answer) {
  ranks_.send(static_cast<int>(rank), RenderTag::kAnswer + static_cast<int>(slot), std::move(answer));
}

std::optional<RayMail::Letter> RankMail::next_question(std::chrono::milliseconds timeout) {
  return next(RenderTag::kQuestion, timeout);
}

std::optional<RayMail::Letter> RankMail::next_answer(unsigned slot, std::chrono::milliseconds timeout) {
  return next(RenderTag::kAnswer + static_cast<int>(slot), timeout);
}

std::optional<RayMail::Letter> RankMail::next(int tag, std::chrono::milliseconds timeout) {
  auto message = ranks_.receive(tag, timeout);
  if (!message) return std::nullopt;
  return Letter{static_cast<unsigned>(message->from), std::move(message->bytes)};
}

build::Result<void> RankMail::health() const {
  if (auto health = ranks_.health(); !health) return health;
  if (const std::vector<int> lost = ranks_.lost(); !lost.empty())
    return fail(build::ErrorCode::kBackend, ranks_.name(lost[0]) + " was lost, and parts of the scene with it");
  if (ranks_.must_stop()) return fail(build::ErrorCode::kCancelled, "cancelled");
  return {};
}

}  // namespace hiprt::tools
