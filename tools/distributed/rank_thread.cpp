// The thread of a rank: pieces of messages, signs of life, and who is lost.
#include <tools/distributed/rank_service.h>

#include <algorithm>
#include <cstring>

namespace hiprt::tools {
namespace {

constexpr int kMostPiecesInFlight = 4;  ///< Per rank.
constexpr std::size_t kSizeBytes = sizeof(std::uint64_t);

/// Flags in the first byte of a beat. Beats of rank 0 go on with the numbers of the ranks that are lost, u32 each.
constexpr std::uint8_t kLeaving = 1;  ///< The sender called leave().
constexpr std::uint8_t kGo = 2;       ///< Of rank 0: end the process.
constexpr std::uint8_t kClean = 4;    ///< With kGo: all ranks are there.

/// What ranks tell each other when they meet.
struct Card {
  std::int64_t pid;
  std::uint64_t start, pid_space;
  char host[kRankCardBytes - 3 * sizeof(std::uint64_t)];
};
static_assert(sizeof(Card) == kRankCardBytes);

Card card_of(const ProcessId& process) {
  Card card{.pid = process.pid, .start = process.start, .pid_space = process.pid_space, .host = {}};
  process.host.copy(card.host, sizeof(card.host) - 1);
  return card;
}

}  // namespace

void RankService::run() {
  auto opened = open();
  {
    const std::lock_guard lock(mutex_);
    if (!opened) start_fault_ = opened.error();
    started_ = true;
    to_callers_.notify_all();
  }
  for (bool go_on = opened.has_value(); go_on;) {
    const bool busy = step();
    std::unique_lock lock(mutex_);
    // Waiting callers need short latencies. Without them the thread only keeps large messages moving.
    const auto pause = std::chrono::microseconds(busy ? 0 : waiting_ + unsent_ > 0 ? 200 : 2000);
    if (!ending_ && pause.count() != 0)
      to_thread_.wait_for(lock, pause, [&] { return ending_ || !outbox_.empty() || beat_now_; });
    go_on = !ending_;
  }
  std::unique_lock lock(mutex_);
  const bool close = closing_;
  lock.unlock();
  if (close) wire_->close();
  lock.lock();
  ended_ = true;
  to_callers_.notify_all();
}

build::Result<void> RankService::open() {
  if (auto opened = wire_->open(); !opened) return opened;
  const Card card = card_of(ProcessId::own());
  const auto cards = wire_->meet(std::as_bytes(std::span(&card, 1)));
  if (!cards) return tl::unexpected(cards.error());
  const auto size = static_cast<std::size_t>(wire_->size());
  std::vector<ProcessId> peers(size);
  for (std::size_t i = 0; i < size; ++i) {
    Card other{};
    std::memcpy(&other, cards->data() + i * kRankCardBytes, sizeof(other));
    peers[i] = {.pid = other.pid, .start = other.start, .pid_space = other.pid_space, .host = other.host};
  }
  state_.resize(size);
  for (Peer& peer : state_) peer.heard = Clock::now();
  pieces_in_flight_.resize(size);
  next_beat_ = Clock::now();
  const std::lock_guard lock(mutex_);
  rank_ = wire_->rank();
  peers_ = std::move(peers);
  lost_.resize(size);
  leaves_.resize(size);
  return {};
}

bool RankService::step() {
  take_outbox();
  bool busy = send_pieces();
  busy = check_sent() || busy;
  busy = receive_pieces() || busy;
  bool now = Clock::now() >= next_beat_;
  {
    const std::lock_guard lock(mutex_);
    now = now || beat_now_;
    beat_now_ = false;
  }
  if (now) {
    watch();
    beat();
  }
  return busy;
}

void RankService::take_outbox() {
  const std::lock_guard lock(mutex_);
  for (auto& [to, message] : outbox_) {
    if (lost_[static_cast<std::size_t>(to)] != 0)
      --unsent_;
    else
      state_[static_cast<std::size_t>(to)].queue.push_back(std::move(message));
  }
  outbox_.clear();
}

bool RankService::send_pieces() {
  bool busy = false;
  const ProcessId& own = peers_[static_cast<std::size_t>(rank_)];
  for (std::size_t to = 0; to < state_.size(); ++to) {
    std::deque<Outgoing>& queue = state_[to].queue;
    // A connection to a dead process can make the library wait or complain.
    if (!queue.empty() && watches(static_cast<int>(to)) && peers_[to].is_visible_to(own) && peers_[to].is_dead())
      lose(static_cast<int>(to), "its process has ended");
    while (!queue.empty() && pieces_in_flight_[to] < kMostPiecesInFlight) {
      Outgoing& message = queue.front();
      send_piece(static_cast<int>(to), message);
      if (message.at == message.bytes->size()) queue.pop_front();
      busy = true;
    }
  }
  return busy;
}

void RankService::send_piece(int to, Outgoing& message) {
  InFlight& piece = in_flight_.emplace_back();
  piece.to = to;
  const std::uint64_t total = message.bytes->size();
  std::span<const std::byte> bytes;
  if (!message.begun) {
    const std::size_t count = std::min<std::size_t>(total, kMostPieceBytes - kSizeBytes);
    piece.head.resize(kSizeBytes + count);
    std::memcpy(piece.head.data(), &total, kSizeBytes);
    std::copy_n(message.bytes->begin(), count, piece.head.begin() + kSizeBytes);
    bytes = piece.head;
    message.at = count;
    message.begun = true;
  } else {
    const std::size_t count = std::min<std::size_t>(total - message.at, kMostPieceBytes);
    piece.rest = message.bytes;
    bytes = std::span(*message.bytes).subspan(message.at, count);
    message.at += count;
  }
  piece.last = message.at == total;
  piece.ticket = wire_->send(to, message.tag, bytes);
  ++pieces_in_flight_[static_cast<std::size_t>(to)];
}

bool RankService::check_sent() {
  bool busy = false;
  std::size_t gone = 0;
  for (auto at = in_flight_.begin(); at != in_flight_.end();) {
    if (at->ticket != 0 && !wire_->sent(at->ticket)) {
      ++at;
      continue;
    }
    --pieces_in_flight_[static_cast<std::size_t>(at->to)];
    gone += at->last ? 1 : 0;
    at = in_flight_.erase(at);
    busy = true;
  }
  if (gone == 0) return busy;
  const std::lock_guard lock(mutex_);
  unsent_ -= gone;
  to_callers_.notify_all();
  return busy;
}

bool RankService::receive_pieces() {
  constexpr auto kMostTime = std::chrono::milliseconds(50);  // Signs of life must not wait for long.
  bool busy = false;
  for (const auto end = Clock::now() + kMostTime; Clock::now() < end;) {
    auto piece = wire_->receive();
    if (!piece) break;
    busy = true;
    const auto from = static_cast<std::size_t>(piece->from);
    state_[from].heard = Clock::now();
    if (is_lost(piece->from)) continue;
    if (piece->tag == kBeatTag)
      hear_beat(piece->from, piece->bytes);
    else
      assemble(std::move(*piece));
  }
  return busy;
}

void RankService::assemble(WirePiece&& piece) {
  Partial& partial = partial_[{piece.from, piece.tag}];
  std::span<const std::byte> bytes = piece.bytes;
  if (!partial.begun) {
    if (bytes.size() < kSizeBytes) return;
    std::memcpy(&partial.total, bytes.data(), kSizeBytes);
    bytes = bytes.subspan(kSizeBytes);
    partial.bytes.reserve(partial.total);
    partial.begun = true;
  }
  partial.bytes.insert(partial.bytes.end(), bytes.begin(), bytes.end());
  if (partial.bytes.size() < partial.total) return;
  RankMessage message{piece.from, piece.tag, std::move(partial.bytes)};
  partial = {};
  deliver(std::move(message));
}

void RankService::deliver(RankMessage&& message) {
  const std::lock_guard lock(mutex_);
  if (message.tag != kStopTag)
    inbox_.push_back(std::move(message));
  else if (!must_stop_.exchange(true))
    ++events_;
  to_callers_.notify_all();
}

std::vector<std::byte> RankService::beat_bytes() const {
  const std::lock_guard lock(mutex_);
  unsigned flags = leaving_ ? kLeaving : 0;
  if (rank_ == 0 && go_) flags |= kGo | (*go_ ? kClean : 0u);
  std::vector<std::byte> bytes{static_cast<std::byte>(flags)};
  if (rank_ != 0) return bytes;
  for (std::uint32_t i = 0; i < lost_.size(); ++i) {
    if (lost_[i] == 0) continue;
    const auto raw = std::as_bytes(std::span(&i, 1));
    bytes.insert(bytes.end(), raw.begin(), raw.end());
  }
  return bytes;
}

void RankService::beat() {
  const std::vector<std::byte> bytes = beat_bytes();
  const bool go = (std::to_integer<unsigned>(bytes[0]) & kGo) != 0;
  bool all_told = true;
  const ProcessId& own = peers_[static_cast<std::size_t>(rank_)];
  next_beat_ = Clock::now() + options_.beat;
  for (std::size_t to = 0; to < state_.size(); ++to) {
    Peer& peer = state_[to];
    // A rank that is lost but lives is told so, unless that could block.
    const bool gone = is_lost(static_cast<int>(to)) &&
                      (peer.beat_ticket != 0 || !peers_[to].is_visible_to(own) || peers_[to].is_dead());
    if (!watches(static_cast<int>(to)) || gone) continue;
    if (peer.beat_ticket != 0 && wire_->sent(peer.beat_ticket)) peer.beat_ticket = 0;
    if (peer.beat_ticket == 0 && !peer.told_to_go) {
      peer.beat = bytes;
      peer.beat_ticket = wire_->send(static_cast<int>(to), kBeatTag, peer.beat);
      peer.told_to_go = go;
    }
    if (peer.beat_ticket != 0 && wire_->sent(peer.beat_ticket)) peer.beat_ticket = 0;
    all_told = all_told && peer.told_to_go && peer.beat_ticket == 0;
  }
  if (!go) return;
  const std::lock_guard lock(mutex_);
  told_ = all_told;
  beat_now_ = !all_told;
  to_callers_.notify_all();
}

void RankService::hear_beat(int from, std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const auto flags = std::to_integer<unsigned>(bytes[0]);
  const std::lock_guard lock(mutex_);
  if (rank_ == 0) {
    leaves_[static_cast<std::size_t>(from)] = (flags & kLeaving) != 0 ? 1 : 0;
    to_callers_.notify_all();
    return;
  }
  for (std::size_t at = 1; at + sizeof(std::uint32_t) <= bytes.size(); at += sizeof(std::uint32_t)) {
    std::uint32_t other = 0;
    std::memcpy(&other, bytes.data() + at, sizeof(other));
    if (other >= lost_.size() || lost_[other] != 0) continue;
    lost_[other] = 1;
    ++events_;
    if (static_cast<int>(other) == rank_)
      break_off("rank 0 takes this rank for lost: it gave no sign of life for " +
                std::to_string(options_.silence.count()) + " ms");
  }
  if ((flags & kGo) != 0) go_ = (flags & kClean) != 0;
  to_callers_.notify_all();
}

void RankService::watch() {
  const auto now = Clock::now();
  const ProcessId& own = peers_[static_cast<std::size_t>(rank_)];
  // After a pause of this process itself, the others' signs of life are still in the wire.
  if (now - watched_ > options_.silence / 2)
    for (Peer& peer : state_) peer.heard = now;
  watched_ = now;
  for (std::size_t other = 0; other < state_.size(); ++other) {
    if (!watches(static_cast<int>(other)) || is_lost(static_cast<int>(other))) continue;
    if (peers_[other].is_visible_to(own) && peers_[other].is_dead())
      lose(static_cast<int>(other), "its process has ended");
    else if (now - state_[other].heard > options_.silence)
      lose(static_cast<int>(other), "it gave no sign of life for " + std::to_string(options_.silence.count()) + " ms");
  }
}

void RankService::break_off(const std::string& reason) {
  if (!broken_) broken_ = reason;
  must_stop_ = true;
  ++events_;
}

void RankService::lose(int other, const std::string& reason) {
  const auto index = static_cast<std::size_t>(other);
  // What it sent before its end may still be in the wire.
  receive_pieces();
  wire_->forget(other);
  std::erase_if(partial_, [&](const auto& entry) { return entry.first.first == other; });
  const std::lock_guard lock(mutex_);
  if (lost_[index] != 0) return;
  lost_[index] = 1;
  ++events_;
  unsent_ -= state_[index].queue.size();
  state_[index].queue.clear();
  for (InFlight& piece : in_flight_) {
    if (piece.to != other) continue;
    if (piece.last) --unsent_;
    piece.last = false;
  }
  if (other == 0) break_off("rank 0 (process " + std::to_string(peers_[0].pid) + ") was lost: " + reason);
  beat_now_ = true;
  to_callers_.notify_all();
}

}  // namespace hiprt::tools
