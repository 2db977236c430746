#pragma once
/// The cores of ranks in simulated time. They work on tasks by priority, and a task of a lower priority gives way.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <queue>
#include <vector>

namespace hiprt::bench {

/// The kinds of tasks, the most urgent first.
enum class TaskKind : std::uint8_t { kMessage, kAnswer, kPath };
inline constexpr std::size_t kTaskKinds = 3;

/// Events of all ranks, in the order of their times.
class RankCores {
 public:
  /// Called when a task is done. @param subject as given to start().
  using Done = std::function<void(TaskKind kind, unsigned rank, std::uint32_t subject)>;
  /// Called at the time of an event of wait_until().
  using Arrived = std::function<void(std::uint32_t subject)>;

  /// @param cores of each rank. At most so many tasks of a kind are worked on at once, and one of kMessage.
  RankCores(unsigned ranks, unsigned cores, Done done, Arrived arrived);

  double now() const { return now_; }
  void start(TaskKind kind, unsigned rank, double seconds, std::uint32_t subject);
  void wait_until(double time, std::uint32_t subject);
  /// Goes on to the next event and tells of it. @return false: there is none.
  bool step();

  /// Seconds of all tasks of a kind that were started on a rank.
  double seconds(unsigned rank, TaskKind kind) const { return ranks_[rank].seconds[index(kind)]; }

 private:
  struct Task {
    double left = 0.0, began = 0.0;
    std::uint32_t subject = 0, turn = 0;  ///< A task that gave way and goes on has a new turn.
    unsigned rank = 0;
    TaskKind kind{};
  };
  struct Rank {
    std::array<std::deque<std::uint32_t>, kTaskKinds> waiting;
    std::array<std::vector<std::uint32_t>, kTaskKinds> running;
    std::array<double, kTaskKinds> seconds{};
  };
  struct Event {
    double time;
    std::uint64_t number;  ///< Of equal times, the first comes first.
    std::uint32_t subject, turn;
    bool is_task;

    friend bool operator>(const Event& a, const Event& b) {
      return a.time != b.time ? a.time > b.time : a.number > b.number;
    }
  };

  static std::size_t index(TaskKind kind) { return static_cast<std::size_t>(kind); }
  void dispatch(unsigned rank);
  /// Makes a task of a lower priority wait. @return false: there is none.
  bool give_way(Rank& rank, std::size_t to);

  unsigned cores_;
  Done done_;
  Arrived arrived_;
  std::vector<Rank> ranks_;
  std::vector<Task> tasks_;
  std::vector<std::uint32_t> free_tasks_;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::uint64_t next_number_ = 0;
  double now_ = 0.0;
};

}  // namespace hiprt::bench
