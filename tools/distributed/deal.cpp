#include <tools/distributed/deal.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/distributed/deal_queue.h>

#include <cstring>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

using namespace std::chrono_literals;

constexpr int kToWorker = 900, kToDealer = 901;
constexpr auto kTick = 100ms;

enum class Kind : std::uint32_t { kUnit, kEnd, kReady, kResult, kFailure, kNote };

/// The start of every message. The payload follows.
struct Header {
  std::uint32_t epoch = 0;  ///< Of the call of deal(): messages of earlier calls are dropped.
  Kind kind{};
  std::uint64_t unit = 0;
};

std::vector<std::byte> packed(const Header& header, std::span<const std::byte> payload = {}) {
  std::vector<std::byte> bytes(sizeof(Header) + payload.size());
  std::memcpy(bytes.data(), &header, sizeof(Header));
  if (!payload.empty()) std::memcpy(bytes.data() + sizeof(Header), payload.data(), payload.size());
  return bytes;
}

/// @return the header, which is cut off @p bytes.
Header unpacked(std::span<const std::byte>& bytes) {
  Header header;
  if (bytes.size() < sizeof(Header)) return header;
  std::memcpy(&header, bytes.data(), sizeof(Header));
  bytes = bytes.subspan(sizeof(Header));
  return header;
}

std::vector<std::byte> failure(std::uint32_t epoch, std::size_t unit, const build::Error& error) {
  const std::uint32_t code = static_cast<std::uint32_t>(error.code);
  std::vector<std::byte> payload(sizeof(code) + error.message.size());
  std::memcpy(payload.data(), &code, sizeof(code));
  std::memcpy(payload.data() + sizeof(code), error.message.data(), error.message.size());
  return packed({epoch, Kind::kFailure, unit}, payload);
}

build::Error error_of(std::span<const std::byte> payload) {
  std::uint32_t code = 0;
  if (payload.size() < sizeof(code)) return {build::ErrorCode::kBackend, "a rank failed and gave no reason"};
  std::memcpy(&code, payload.data(), sizeof(code));
  const auto text = payload.subspan(sizeof(code));
  return {static_cast<build::ErrorCode>(code), {reinterpret_cast<const char*>(text.data()), text.size()}};
}

/// The part of every rank that works.
class Worker {
 public:
  Worker(Ranks& ranks, std::uint32_t epoch, const std::atomic<bool>& stop, const DealWork& work)
      : ranks_(ranks), epoch_(epoch), stop_(stop), work_(work) {}

  build::Result<void> run() {
    ranks_.send(0, kToDealer, packed({epoch_, Kind::kReady, 0}));
    for (;;) {
      const auto message = ranks_.receive(kToWorker, kTick);
      if (auto healthy = ranks_.health(); !healthy) return healthy;
      std::span<const std::byte> bytes;
      if (message) bytes = message->bytes;
      const Header header = unpacked(bytes);
      const bool is_own = message && header.epoch == epoch_;
      if (is_own && header.kind == Kind::kEnd) return {};
      if (stop_ || ranks_.must_stop()) return cancelled();
      if (!is_own) continue;
      ranks_.send(0, kToDealer, do_unit(header.unit));
    }
  }

 private:
  std::vector<std::byte> do_unit(std::size_t unit) {
    try {
      const auto result = work_(DealtUnit(ranks_, stop_, epoch_, unit));
      if (!result) return failure(epoch_, unit, result.error());
      return packed({epoch_, Kind::kResult, unit}, *result);
    } catch (const std::bad_alloc&) {
      return failure(epoch_, unit,
                     {build::ErrorCode::kOutOfMemory, ranks_.name(ranks_.rank()) + ": not enough memory"});
    } catch (const std::exception& error) {
      return failure(epoch_, unit, {build::ErrorCode::kBackend, ranks_.name(ranks_.rank()) + ": " + error.what()});
    }
  }

  Ranks& ranks_;
  std::uint32_t epoch_;
  const std::atomic<bool>& stop_;
  const DealWork& work_;
};

/// The part of rank 0 that deals.
class Dealer {
 public:
  Dealer(Ranks& ranks, std::uint32_t epoch, std::span<const double> costs, const DealOptions& options,
         const DealEvents& events)
      : ranks_(ranks),
        epoch_(epoch),
        options_(options),
        events_(events),
        queue_(costs, ranks.size(), options.retries),
        ready_(static_cast<std::size_t>(ranks.size())) {}

  build::Result<DealReport> run() {
    for (;;) {
      if (!take_losses()) break;
      if (fault_) return tl::unexpected(*fault_);
      if (queue_.ended() || (!options_.first_works && !queue_.others_live())) break;
      for (int rank = 0; rank < ranks_.size(); ++rank) top_up(rank);
      const auto message = ranks_.receive(kToDealer, kTick);
      if (message)
        if (auto taken = take(*message); !taken) return tl::unexpected(taken.error());
      if (events_.tick && !events_.tick()) return cancelled();
    }
    return DealReport{lost_, queue_.not_done()};
  }

  void end_workers() {
    for (int rank = 0; rank < ranks_.size(); ++rank) ranks_.send(rank, kToWorker, packed({epoch_, Kind::kEnd, 0}));
  }

 private:
  /// @return false: a rank is lost, and the run must not go on without it.
  bool take_losses() {
    for (const int rank : ranks_.lost()) {
      if (queue_.is_lost(rank)) continue;
      // Results that arrived before the loss count.
      while (const auto message = ranks_.receive(kToDealer, 0ms))
        if (auto taken = take(*message); !taken) fault_ = fault_ ? fault_ : std::optional(taken.error());
      const std::vector<std::size_t> units = queue_.lose(rank);
      lost_.push_back(rank);
      if (events_.lost) events_.lost(rank, units);
    }
    return lost_.empty() || options_.lossy;
  }

  void top_up(int rank) {
    if (queue_.is_lost(rank) || ready_[static_cast<std::size_t>(rank)] == 0) return;
    while (queue_.running(rank) < options_.ahead) {
      const auto unit = queue_.next(rank);
      if (!unit) return;
      ranks_.send(rank, kToWorker, packed({epoch_, Kind::kUnit, *unit}));
      if (events_.begun) events_.begun(*unit, rank);
    }
  }

  build::Result<void> take(const RankMessage& message) {
    std::span<const std::byte> bytes = message.bytes;
    const Header header = unpacked(bytes);
    if (header.epoch != epoch_ || queue_.is_lost(message.from)) return {};
    if (header.kind == Kind::kReady) ready_[static_cast<std::size_t>(message.from)] = 1;
    if (header.kind == Kind::kFailure) return tl::unexpected(error_of(bytes));
    if (header.kind == Kind::kNote && events_.note) events_.note(header.unit, message.from, bytes);
    if (header.kind != Kind::kResult || !queue_.finish(message.from, header.unit) || !events_.collect) return {};
    return events_.collect(header.unit, message.from, {bytes.begin(), bytes.end()});
  }

  Ranks& ranks_;
  std::uint32_t epoch_;
  const DealOptions& options_;
  const DealEvents& events_;
  DealQueue queue_;
  std::vector<char> ready_;  ///< Ranks that have asked for work.
  std::vector<int> lost_;
  std::optional<build::Error> fault_{};  ///< Of a result that came with a loss.
};

build::Result<DealReport> deal_and_work(Ranks& ranks, std::uint32_t epoch, std::span<const double> costs,
                                        const DealOptions& options, const DealWork& work, const DealEvents& events) {
  std::atomic<bool> stop = false;
  std::thread worker;
  if (options.first_works) worker = std::thread([&] { static_cast<void>(Worker(ranks, epoch, stop, work).run()); });
  Dealer dealer(ranks, epoch, costs, options, events);
  auto report = dealer.run();
  if (!report || (!report->lost_ranks.empty() && !options.lossy)) {
    stop = true;
    ranks.stop_others();
  }
  dealer.end_workers();
  if (worker.joinable()) worker.join();
  return report;
}

}  // namespace

void DealtUnit::note(std::span<const std::byte> bytes) const {
  ranks_.send(0, kToDealer, packed({epoch_, Kind::kNote, unit_}, bytes));
}

build::Result<DealReport> deal(Ranks& ranks, std::span<const double> costs, const DealOptions& options,
                               const DealWork& work, const DealEvents& events) {
  const std::uint32_t epoch = ranks.next_epoch();
  if (ranks.is_first()) return deal_and_work(ranks, epoch, costs, options, work, events);
  const std::atomic<bool> stop = false;
  if (auto done = Worker(ranks, epoch, stop, work).run(); !done) return tl::unexpected(done.error());
  return DealReport{};
}

}  // namespace hiprt::tools
