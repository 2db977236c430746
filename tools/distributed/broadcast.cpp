#include <tools/distributed/broadcast.h>

#include <tools/base/interrupt.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace hiprt::tools {
namespace {

using namespace std::chrono_literals;

constexpr int kBroadcast = 910, kHere = 911, kAllHere = 912;

build::Result<RankMessage> receive_from_first(Ranks& ranks, int tag) {
  for (;;) {
    if (auto message = ranks.receive(tag, 100ms)) return std::move(*message);
    if (auto healthy = ranks.health(); !healthy) return tl::unexpected(healthy.error());
    if (interrupted() || ranks.must_stop()) return cancelled();
  }
}

}  // namespace

build::Result<SharedBytes> broadcast(Ranks& ranks, SharedBytes bytes, std::span<const int> to) {
  if (ranks.is_first()) {
    for (const int rank : to)
      if (rank != 0) ranks.send(rank, kBroadcast, bytes);
    return bytes;
  }
  if (std::find(to.begin(), to.end(), ranks.rank()) == to.end()) return SharedBytes{};
  auto message = receive_from_first(ranks, kBroadcast);
  if (!message) return tl::unexpected(message.error());
  return std::make_shared<const std::vector<std::byte>>(std::move(message->bytes));
}

build::Result<void> wait_for_all(Ranks& ranks) {
  if (!ranks.is_first()) {
    ranks.send(0, kHere, std::vector<std::byte>{});
    auto message = receive_from_first(ranks, kAllHere);
    return message ? build::Result<void>{} : tl::unexpected(message.error());
  }
  std::vector<char> here(static_cast<std::size_t>(ranks.size()));
  here[0] = 1;
  const auto missing = [&] {
    for (int i = 0; i < ranks.size(); ++i)
      if (here[static_cast<std::size_t>(i)] == 0 && !ranks.is_lost(i)) return true;
    return false;
  };
  while (missing()) {
    if (interrupted()) return cancelled();
    if (const auto message = ranks.receive(kHere, 100ms)) here[static_cast<std::size_t>(message->from)] = 1;
  }
  for (int i = 1; i < ranks.size(); ++i) ranks.send(i, kAllHere, std::vector<std::byte>{});
  return {};
}

}  // namespace hiprt::tools
