#pragma once
/// The ranks of a run that compute units of a picture: rank 0 deals, the others compute.

#include <tools/distributed/ranks.h>
#include <tools/render/units/crew.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Tags of the messages of bvhrender.
struct RenderTag {
  static constexpr int kMeans = 1;     ///< To rank 0: RankMeans.
  static constexpr int kBegin = 2;     ///< From rank 0: RankBegin.
  static constexpr int kReady = 3;     ///< To rank 0: workers and PictureKey.
  static constexpr int kJob = 4;       ///< From rank 0: encode(UnitJob).
  static constexpr int kResult = 5;    ///< To rank 0: encode(UnitResult).
  static constexpr int kGone = 6;      ///< To rank 0: this rank ends. An error's text, or nothing after a signal.
  static constexpr int kQuestion = 7;  ///< Of scenes in parts: encode(PartQuestion), to the rank with the part.
  static constexpr int kAnswer = 100;  ///< And the answer; the slot that waits for it is added.
};

/// Notices ranks that are gone. Used by rank 0.
class RankWatch {
 public:
  /// @param lossy whether the run goes on without lost ranks. @param warn told of each of them then.
  /// @param advice what the error of a lost rank says at its end.
  RankWatch(Ranks& ranks, bool lossy, std::function<void(const std::string&)> warn,
            std::string advice = "with --lossy-ranks the run would go on without it");

  Ranks& ranks() { return ranks_; }
  bool is_gone(int rank) const { return gone_[static_cast<std::size_t>(rank)] != 0; }

  /// @return the ranks that are gone since the last call, or the error that a rank ended with. Without `lossy` a rank
  /// that is gone is an error, kBackend. If this process is interrupted too, it is none: a signal to mpirun reaches all
  /// ranks, but not all at once.
  build::Result<std::vector<int>> news();

 private:
  build::Result<void> lose(int rank, const char* reason);

  Ranks& ranks_;
  bool lossy_;
  std::function<void(const std::string&)> warn_;
  std::string advice_;
  std::vector<char> gone_;
};

/// Rank 0's view of the others.
class RankCrew : public Crew {
 public:
  /// @param workers of every rank; 0: it takes no part.
  RankCrew(RankWatch& watch, std::vector<unsigned> workers, std::size_t pixel_bytes);

  unsigned ranks() const override { return static_cast<unsigned>(workers_.size()); }
  unsigned workers(unsigned rank) const override { return workers_[rank]; }
  void send(unsigned rank, UnitJob job) override;
  build::Result<std::vector<CrewEvent>> poll() override;

 private:
  RankWatch& watch_;
  std::vector<unsigned> workers_;
  std::size_t pixel_bytes_;
};

/// Computes units on a rank other than 0 until rank 0 ends the run, or a signal interrupts this process.
/// @return kBackend: rank 0 is lost; kCancelled after a signal; kInvalidInput for messages that are malformed.
build::Result<void> compute_for_first_rank(Ranks& ranks, PictureWork& work);

/// Ends the work of a rank other than 0: tells rank 0 of an error or a signal.
/// @return kBackend if rank 0 is lost. Other errors are rank 0's to report.
build::Result<void> end_follower(Ranks& ranks, const build::Result<void>& done);

}  // namespace hiprt::tools
