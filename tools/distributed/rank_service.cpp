// The calls of Ranks, made by any thread. rank_thread.cpp has the thread that serves them.
#include <tools/distributed/rank_service.h>

#include <tools/base/errors.h>

#include <algorithm>
#include <utility>

namespace hiprt::tools {
namespace {

/// Time that mpirun may take to start all ranks of a machine.
constexpr auto kGrace = std::chrono::seconds(5);

}  // namespace

RankService::RankService(std::unique_ptr<Wire> wire, const RankOptions& options)
    : options_(options), wire_(std::move(wire)), peers_{ProcessId::own()}, lost_(1), leaves_(1) {}

build::Result<void> RankService::wait_for_start() {
  const auto begin = Clock::now();
  std::unique_lock lock(mutex_);
  // MPI_Init() waits for ever for a rank that has died.
  while (!to_callers_.wait_for(lock, std::chrono::milliseconds(500), [&] { return started_; })) {
    if (Clock::now() - begin > kGrace && sibling_is_missing())
      return fail(build::ErrorCode::kBackend, "MPI did not start: a rank of this machine has ended; start it again");
    if (Clock::now() - begin > options_.start)
      return fail(build::ErrorCode::kBackend, "MPI did not start within " + std::to_string(options_.start.count()) +
                                                  " ms: not all ranks came; start it again");
  }
  if (start_fault_) return tl::unexpected(*start_fault_);
  return {};
}

bool RankService::end(bool close) {
  std::unique_lock lock(mutex_);
  ending_ = true;
  closing_ = close;
  to_thread_.notify_all();
  return to_callers_.wait_for(lock, options_.end, [&] { return ended_; });
}

void RankService::send(int to, int tag, SharedBytes bytes) {
  const std::lock_guard lock(mutex_);
  send_locked(to, tag, std::move(bytes));
}

void RankService::send_locked(int to, int tag, SharedBytes bytes) {
  if (to == rank_) {
    inbox_.push_back({rank_, tag, *bytes});
    to_callers_.notify_all();
    return;
  }
  if (lost_[static_cast<std::size_t>(to)] != 0) return;
  ++unsent_;
  outbox_.emplace_back(to, Outgoing{tag, std::move(bytes)});
  to_thread_.notify_all();
}

std::optional<RankMessage> RankService::receive(std::span<const int> tags, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const auto wanted = [&](const RankMessage& message) {
    return std::find(tags.begin(), tags.end(), message.tag) != tags.end();
  };
  const std::uint64_t events = events_;
  auto found = inbox_.end();
  ++waiting_;
  to_thread_.notify_all();
  to_callers_.wait_for(lock, timeout, [&] {
    found = std::find_if(inbox_.begin(), inbox_.end(), wanted);
    return found != inbox_.end() || events_ != events;
  });
  --waiting_;
  if (found == inbox_.end()) return std::nullopt;
  RankMessage message = std::move(*found);
  inbox_.erase(found);
  return message;
}

bool RankService::flush(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return to_callers_.wait_for(lock, timeout, [&] { return unsent_ == 0; });
}

std::vector<int> RankService::lost() const {
  const std::lock_guard lock(mutex_);
  std::vector<int> result;
  for (std::size_t i = 0; i < lost_.size(); ++i)
    if (lost_[i] != 0) result.push_back(static_cast<int>(i));
  return result;
}

bool RankService::is_lost(int rank) const {
  const std::lock_guard lock(mutex_);
  return lost_[static_cast<std::size_t>(rank)] != 0;
}

void RankService::stop_others() {
  const std::lock_guard lock(mutex_);
  stop_others_locked();
}

void RankService::stop_others_locked() {
  // A message and no part of a beat: it must not overtake messages that were sent before.
  if (std::exchange(stopped_others_, true)) return;
  const auto nothing = std::make_shared<const std::vector<std::byte>>();
  for (int to = 0; to < size(); ++to)
    if (to != rank_) send_locked(to, kStopTag, nothing);
}

build::Result<void> RankService::health() const {
  const std::lock_guard lock(mutex_);
  if (broken_) return fail(build::ErrorCode::kBackend, *broken_);
  return {};
}

bool RankService::everyone_leaves() const {
  for (std::size_t i = 1; i < leaves_.size(); ++i)
    if (leaves_[i] == 0 && lost_[i] == 0) return false;
  return true;
}

bool RankService::agree_to_leave() {
  std::unique_lock lock(mutex_);
  leaving_ = true;
  beat_now_ = true;
  to_thread_.notify_all();
  if (rank_ == 0) {
    stop_others_locked();
    const bool all = to_callers_.wait_for(lock, options_.end, [&] { return everyone_leaves(); });
    go_ = all && std::find(lost_.begin(), lost_.end(), 1) == lost_.end();
    beat_now_ = true;
    to_thread_.notify_all();
    // The last messages and beats must go before the thread ends.
    to_callers_.wait_for(lock, options_.end, [&] { return told_ && unsent_ == 0; });
  } else {
    // No time limit: rank 0 may still compute. The wait ends when rank 0 is silent for too long.
    to_callers_.wait(lock, [&] { return go_ || broken_; });
  }
  return go_.value_or(false) && !broken_;
}

}  // namespace hiprt::tools
