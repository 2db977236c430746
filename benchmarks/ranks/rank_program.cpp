#include "rank_program.h"

#include <tools/base/interrupt.h>
#include <tools/base/text.h>

namespace hiprt::bench {

build::Result<std::vector<unsigned>> parse_ranks(const std::vector<std::string>& words, unsigned most) {
  std::vector<unsigned> ranks;
  for (const std::string& word : words) {
    const auto number = tools::parse_integer(word);
    if (!number || *number < 1 || *number > most) {
      return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                         "--ranks=" + word + ": expected numbers from 1 to " + std::to_string(most)});
    }
    ranks.push_back(static_cast<unsigned>(*number));
  }
  return ranks;
}

int run_on_ranks(const std::function<int(const std::string& message, int status)>& fail,
                 const std::function<build::Result<void>(tools::Ranks&)>& measure,
                 const std::function<int()>& predict) {
  const tools::InterruptGuard guard;
  auto ranks = tools::Ranks::join();
  if (!ranks) return fail(ranks.error().message, kFailure);
  const auto measured = measure(**ranks);
  int status = 0;
  if (!measured)
    status = fail(measured.error().message, kFailure);
  else if ((*ranks)->is_first())
    status = predict();
  return tools::leave_run(ranks->get(), status);
}

}  // namespace hiprt::bench
