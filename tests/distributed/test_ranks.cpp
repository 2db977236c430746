// Ranks as threads of one process: their wire is a queue in memory, which can lose pieces.

#include <tests/catch.h>
#include <tools/distributed/broadcast.h>
#include <tools/distributed/deal.h>
#include <tools/distributed/wire.h>

#include <cstring>
#include <deque>
#include <mutex>
#include <thread>

using namespace hiprt;
using namespace hiprt::tools;
using namespace std::chrono_literals;

namespace {

/// All wires of a run.
struct Hub {
  explicit Hub(int ranks) : size(ranks), inboxes(static_cast<std::size_t>(ranks)), silent(inboxes.size()) {}

  const int size;
  std::mutex mutex{};
  std::vector<std::deque<WirePiece>> inboxes;
  std::vector<char> silent;  ///< Ranks whose pieces go nowhere, as if their machine had failed.
  std::vector<std::byte> cards{};
  int cards_there = 0;
};

class HubWire final : public Wire {
 public:
  HubWire(Hub& hub, int rank) : hub_(hub), rank_(rank) {}
  build::Result<void> open() override { return {}; }
  int rank() const override { return rank_; }
  int size() const override { return hub_.size; }
  build::Result<std::vector<std::byte>> meet(std::span<const std::byte> card) override {
    std::unique_lock lock(hub_.mutex);
    hub_.cards.resize(static_cast<std::size_t>(hub_.size) * kRankCardBytes);
    std::memcpy(hub_.cards.data() + static_cast<std::size_t>(rank_) * kRankCardBytes, card.data(), kRankCardBytes);
    ++hub_.cards_there;
    while (hub_.cards_there < hub_.size) {
      lock.unlock();
      std::this_thread::sleep_for(1ms);
      lock.lock();
    }
    return hub_.cards;
  }
  std::uint64_t send(int to, int tag, std::span<const std::byte> bytes) override {
    const std::lock_guard lock(hub_.mutex);
    if (hub_.silent[static_cast<std::size_t>(rank_)] == 0)
      hub_.inboxes[static_cast<std::size_t>(to)].push_back({rank_, tag, {bytes.begin(), bytes.end()}});
    return 1;
  }
  bool sent(std::uint64_t) override { return true; }
  std::optional<WirePiece> receive() override {
    const std::lock_guard lock(hub_.mutex);
    auto& inbox = hub_.inboxes[static_cast<std::size_t>(rank_)];
    if (inbox.empty()) return std::nullopt;
    WirePiece piece = std::move(inbox.front());
    inbox.pop_front();
    return piece;
  }
  void forget(int) override {}
  void close() override {}

 private:
  Hub& hub_;
  int rank_;
};

/// Calls @p body(ranks) in a thread per rank.
template <class Body> void on_ranks(Hub& hub, const Body& body) {
  const RankOptions options{.lossy = true, .beat = 20ms, .silence = 1000ms, .start = 5000ms, .end = 3000ms};
  std::vector<std::thread> threads;
  for (int rank = 0; rank < hub.size; ++rank)
    threads.emplace_back([&, rank] {
      auto ranks = Ranks::join(std::make_unique<HubWire>(hub, rank), options);
      if (ranks) body(**ranks);
    });
  for (std::thread& thread : threads) thread.join();
}

std::vector<std::byte> text_bytes(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

TEST_CASE("ranks: a program that was started alone is rank 0 of 1 and can send to itself") {
  Ranks ranks;
  CHECK(ranks.rank() == 0);
  CHECK(ranks.size() == 1);
  CHECK(ranks.local_size() == 1);
  CHECK_FALSE(ranks.receive(7, 0ms));
  ranks.send(0, 7, text_bytes("first"));
  ranks.send(0, 8, text_bytes("other"));
  const auto message = ranks.receive(8, 0ms);
  REQUIRE(message);
  CHECK(message->bytes == text_bytes("other"));
  CHECK(ranks.receive(7, 0ms)->bytes == text_bytes("first"));
  CHECK(ranks.leave(3) == 3);
}

TEST_CASE("ranks: messages of all sizes around the size of a piece arrive in order") {
  Hub hub(2);
  const std::vector<std::size_t> sizes{0,
                                       1,
                                       kMostPieceBytes - 9,
                                       kMostPieceBytes - 8,
                                       kMostPieceBytes - 7,
                                       2 * kMostPieceBytes - 8,
                                       2 * kMostPieceBytes - 7,
                                       3};
  std::vector<std::vector<std::byte>> received;
  on_ranks(hub, [&](Ranks& ranks) {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      std::vector<std::byte> bytes(sizes[i]);
      for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k] = static_cast<std::byte>(k * 7 + i);
      if (!ranks.is_first())
        ranks.send(0, 5, bytes);
      else if (auto message = ranks.receive(5, 10000ms))
        received.push_back(std::move(message->bytes));
    }
    ranks.flush(5000ms);
    if (!ranks.is_first()) return;
  });
  REQUIRE(received.size() == sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    REQUIRE(received[i].size() == sizes[i]);
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < sizes[i]; ++k) wrong += received[i][k] != static_cast<std::byte>(k * 7 + i) ? 1 : 0;
    CHECK(wrong == 0);
  }
}

TEST_CASE("ranks: a broadcast reaches the ranks that it names, and all wait for all") {
  Hub hub(4);
  std::vector<std::string> got(4);
  std::atomic<int> here = 0, early = 0;
  const std::vector<int> to{0, 1, 3};
  on_ranks(hub, [&](Ranks& ranks) {
    const auto bytes = broadcast(ranks, std::make_shared<const std::vector<std::byte>>(text_bytes("scene")), to);
    if (bytes && *bytes)
      got[static_cast<std::size_t>(ranks.rank())].assign(reinterpret_cast<const char*>((*bytes)->data()),
                                                         (*bytes)->size());
    std::this_thread::sleep_for(std::chrono::milliseconds(20 * ranks.rank()));
    ++here;
    if (!wait_for_all(ranks) || here != 4) ++early;
    ranks.flush(1000ms);
  });
  CHECK(got == std::vector<std::string>{"scene", "scene", "", "scene"});
  CHECK(early == 0);
}

TEST_CASE("ranks: the units of a rank that falls silent are done by others, and its late results are ignored") {
  Hub hub(3);
  std::vector<int> counts(40);
  DealReport report;
  std::string expelled;
  on_ranks(hub, [&](Ranks& ranks) {
    const std::vector<double> costs(ranks.is_first() ? counts.size() : 0, 1.0);
    DealEvents events;
    events.collect = [&](std::size_t unit, int, const std::vector<std::byte>&) -> build::Result<void> {
      ++counts[unit];
      return {};
    };
    const auto work = [&](const DealtUnit& unit) -> build::Result<std::vector<std::byte>> {
      if (ranks.rank() == 2 && !ranks.is_lost(2)) {
        const std::lock_guard lock(hub.mutex);
        hub.silent[2] = 1;
      }
      std::this_thread::sleep_for(2ms);
      return std::vector<std::byte>(unit.index() % 3);
    };
    auto dealt = deal(ranks, costs, {.ahead = 2, .lossy = true}, work, events);
    if (ranks.is_first() && dealt) report = *dealt;
    if (ranks.rank() == 2 && !dealt) expelled = dealt.error().message;
    ranks.flush(500ms);
  });
  CHECK(report.lost_ranks == std::vector<int>{2});
  CHECK(report.not_done.empty());
  CHECK(counts == std::vector<int>(counts.size(), 1));
  CHECK_THAT(expelled, Catch::Contains("gave no sign of life for 1000 ms"));
}

TEST_CASE("ranks: an error of one rank's work ends the run on all ranks") {
  Hub hub(3);
  std::atomic<int> ended = 0;
  std::string message;
  on_ranks(hub, [&](Ranks& ranks) {
    const std::vector<double> costs(ranks.is_first() ? 1000 : 0, 1.0);
    const auto work = [&](const DealtUnit& unit) -> build::Result<std::vector<std::byte>> {
      std::this_thread::sleep_for(1ms);
      if (unit.index() == 20) return tl::unexpected(build::Error{build::ErrorCode::kIo, "unit 20: the disk is full"});
      return std::vector<std::byte>{};
    };
    const auto dealt = deal(ranks, costs, {}, work, {});
    if (ranks.is_first() && !dealt) message = dealt.error().message;
    if (!ranks.is_first() || !dealt) ++ended;
    ranks.flush(1000ms);
    std::this_thread::sleep_for(100ms);
  });
  CHECK(message == "unit 20: the disk is full");
  CHECK(ended == 3);
}
