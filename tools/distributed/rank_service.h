#pragma once
/// The thread of a rank that makes all calls of the wire. Calls that hang, hang there: callers wait with a limit.

#include <tools/distributed/process.h>
#include <tools/distributed/ranks.h>
#include <tools/distributed/wire.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <utility>

namespace hiprt::tools {

/// Internal tags, above those of Ranks' users.
inline constexpr int kBeatTag = kTagEnd, kStopTag = kTagEnd + 1;

/// State that callers and the thread share, and the thread's loop.
class RankService {
 public:
  using Clock = std::chrono::steady_clock;

  RankService(std::unique_ptr<Wire> wire, const RankOptions& options);

  /// The thread: opens the wire, serves until end(), and closes it if that is safe.
  void run();
  /// Waits for the thread to have opened the wire. @return the error of opening.
  build::Result<void> wait_for_start();
  /// Asks the thread to end. @param close whether to close the wire. @return false: it did not end in time.
  bool end(bool close);

  void send(int to, int tag, SharedBytes bytes);
  std::optional<RankMessage> receive(std::span<const int> tags, std::chrono::milliseconds timeout);
  bool flush(std::chrono::milliseconds timeout);
  std::vector<int> lost() const;
  bool is_lost(int rank) const;
  bool must_stop() const { return must_stop_; }
  void stop_others();
  build::Result<void> health() const;
  /// The first half of Ranks::leave(). @return whether all ranks are there, so that MPI can be ended.
  bool agree_to_leave();

  int rank() const { return rank_; }
  int size() const { return static_cast<int>(peers_.size()); }
  const ProcessId& peer(int rank) const { return peers_[static_cast<std::size_t>(rank)]; }

 private:
  /// A message on its way out.
  struct Outgoing {
    int tag = 0;
    SharedBytes bytes;
    std::size_t at = 0;  ///< Bytes that were handed to the wire.
    bool begun = false;
  };
  /// A piece in the wire; its bytes live until it has gone.
  struct InFlight {
    std::uint64_t ticket = 0;
    int to = -1;
    std::vector<std::byte> head{};  ///< The size of the message and its first bytes.
    SharedBytes rest{};
    bool last = false;  ///< Of its message.
  };
  /// A message whose pieces are arriving.
  struct Partial {
    std::uint64_t total = 0;
    std::vector<std::byte> bytes{};
    bool begun = false;
  };
  /// What the thread knows of another rank.
  struct Peer {
    Clock::time_point heard{};
    std::deque<Outgoing> queue{};
    std::uint64_t beat_ticket = 0;
    std::vector<std::byte> beat{};
    bool leaving = false;
    bool told_to_go = false;
  };

  build::Result<void> open();
  bool step();
  void take_outbox();
  bool send_pieces();
  void send_piece(int to, Outgoing& message);
  bool check_sent();
  bool receive_pieces();
  void assemble(WirePiece&& piece);
  void deliver(RankMessage&& message);
  void send_locked(int to, int tag, SharedBytes bytes);
  void stop_others_locked();
  void beat();
  std::vector<std::byte> beat_bytes() const;
  void hear_beat(int from, std::span<const std::byte> bytes);
  void watch();
  bool watches(int other) const { return other != rank_ && (rank_ == 0 || other == 0); }
  void lose(int other, const std::string& reason);
  void break_off(const std::string& reason);
  bool everyone_leaves() const;

  RankOptions options_;
  std::unique_ptr<Wire> wire_;
  int rank_ = 0;
  std::vector<ProcessId> peers_;

  // Of the thread only.
  std::vector<Peer> state_;
  std::deque<InFlight> in_flight_;
  std::vector<int> pieces_in_flight_;
  std::map<std::pair<int, int>, Partial> partial_;
  Clock::time_point next_beat_{}, watched_{};

  mutable std::mutex mutex_;  ///< Guards all members below.
  std::condition_variable to_thread_, to_callers_;
  bool started_ = false, ended_ = false, ending_ = false, closing_ = false, beat_now_ = false,
       told_ = false;  ///< On rank 0: all others were told to go.
  std::optional<build::Error> start_fault_{};
  std::optional<std::string> broken_{};  ///< Why this rank cannot go on.
  std::deque<std::pair<int, Outgoing>> outbox_;
  std::deque<RankMessage> inbox_;
  std::size_t unsent_ = 0;   ///< Messages that have not gone.
  std::size_t waiting_ = 0;  ///< Callers of receive().
  std::vector<char> lost_;
  std::uint64_t events_ = 0;  ///< Losses and stops so far: they wake callers of receive().
  bool stopped_others_ = false;
  bool leaving_ = false;      ///< This rank called leave().
  std::optional<bool> go_{};  ///< Rank 0 says: end now; whether all are there.
  std::vector<char> leaves_;  ///< On rank 0: who called leave().
  std::atomic<bool> must_stop_ = false;
};

}  // namespace hiprt::tools
