#pragma once
/// The processes of one run (ranks): who they are, messages between them, and who of them was lost.
///
///     auto ranks = Ranks::join();                       // once, in main; alone it costs nothing
///     if (!ranks) return print(ranks.error());
///     ... (*ranks)->send(0, kMyTag, bytes) ... (*ranks)->receive(kMyTag, 100ms) ...
///     return leave_run(ranks->get(), status);           // the last statement of main
///
/// A program that was started alone is the only rank, 0. It can send messages to itself, so callers have one code path.
/// Every wait is bounded. A rank that was killed is noticed after at most two beats on the same machine, and after
/// RankOptions::silence on another one. Rank 0 decides who is lost; the loss of rank 0 ends the run.

#include <hiprt_build/error.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace hiprt::tools {

class RankService;
class Wire;

struct RankOptions {
  /// Whether the run may go on after a rank was lost. Open MPI then talks through TCP, also under mpirun with
  /// recovery_words(), unless the user has set OMPI_MCA_btl. A rank that dies while it writes to shared memory would
  /// block its readers for ever.
  bool lossy = false;
  std::chrono::milliseconds beat{500};        ///< Between two signs of life.
  std::chrono::milliseconds silence{30'000};  ///< A rank that gives no sign for so long is lost.
  std::chrono::milliseconds start{60'000};    ///< Most time to start MPI and to meet.
  std::chrono::milliseconds end{10'000};      ///< Most time that leave() waits for the others.
};

/// Tags of messages are below this one. Tags from 900 on are those of this folder (deal.h, broadcast.h).
inline constexpr int kTagEnd = 1000;

struct RankMessage {
  int from = -1, tag = 0;
  std::vector<std::byte> bytes;
};

/// Bytes of one message that may go to several ranks.
using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

class Ranks {
 public:
  /// Starts MPI if mpirun, Slurm or the like has started this program as one of several. Call it once.
  /// Then the process ignores SIGPIPE.
  /// @return kBackend: MPI is not compiled in or did not start, or not all ranks came in time. Then end the program.
  static build::Result<std::unique_ptr<Ranks>> join(const RankOptions& options = {});
  /// As join(), over @p wire. For tests.
  static build::Result<std::unique_ptr<Ranks>> join(std::unique_ptr<Wire> wire, const RankOptions& options);

  /// Only this process.
  Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  ~Ranks();

  int rank() const;
  int size() const;
  bool is_first() const { return rank() == 0; }
  /// Number of this rank among those of its machine, and how many those are.
  int local_rank() const;
  int local_size() const;
  /// @return the lowest rank of each machine, in ascending order.
  std::vector<int> first_of_hosts() const;
  std::string host(int rank) const;
  /// "rank 2 (process 4711 on node7)"
  std::string name(int rank) const;

  /// Queues a message and returns at once. Messages from one rank to another keep their order. A message to a lost rank
  /// is dropped. Sizes have 64 bits. May be called from any thread.
  void send(int to, int tag, std::vector<std::byte> bytes);
  void send(int to, int tag, SharedBytes bytes);
  /// Waits for a message with one of the tags, or until a rank is lost or the run must stop. May be called from any
  /// thread. Messages that a rank sent before it was lost are received, if they arrived as a whole.
  std::optional<RankMessage> receive(std::span<const int> tags, std::chrono::milliseconds timeout);
  std::optional<RankMessage> receive(int tag, std::chrono::milliseconds timeout) { return receive({&tag, 1}, timeout); }
  /// Waits until all queued messages have gone. @return false: not in time.
  bool flush(std::chrono::milliseconds timeout);

  /// The ranks that are lost, in ascending order. On ranks other than 0 it can be late by two beats.
  std::vector<int> lost() const;
  bool is_lost(int rank) const;
  /// Whether long work should end: rank 0 called stop_others(), rank 0 is lost, or rank 0 takes this rank for lost. On
  /// rank 0 always false. May be called from any thread, often.
  bool must_stop() const;
  /// On rank 0: makes must_stop() true everywhere else.
  void stop_others();
  /// @return kBackend with the reason if this rank cannot go on: rank 0 is lost, or takes this rank for lost.
  build::Result<void> health() const;
  /// A number that is the same on all ranks if all make the same calls: 1, 2, ...
  std::uint32_t next_epoch() { return ++epoch_; }

  /// Ends the run on all ranks: rank 0 waits for the others, at most RankOptions::end; the others wait for rank 0. If
  /// all are there, MPI is ended and @p status is returned. If not, MPI_Finalize() could wait for ever, so the process
  /// ends here with @p status, after a flush of its output. Call it last.
  int leave(int status);

 private:
  /// Ends the thread. @return whether it has ended.
  bool end_thread(bool close);

  std::shared_ptr<RankService> service_;
  std::thread thread_{};  ///< Shares service_: a thread that hangs in MPI must not be joined.
  std::uint32_t epoch_ = 0;
};

/// Ends main() also where join() failed or was not called: the last statement of a program that mpirun may start.
/// Otherwise mpirun --enable-recovery would hide the failure: it ends with 0 whatever its ranks return.
/// @param ranks of join(), or nullptr.
int leave_run(Ranks* ranks, int status);

/// Warning for a run that is to survive lost ranks: mpirun was not started with recovery_words(), so it will end the
/// run. Empty: nothing to warn of.
std::string recovery_warning();

}  // namespace hiprt::tools
