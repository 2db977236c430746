#include "rank_cores.h"

#include <algorithm>
#include <utility>

namespace hiprt::bench {

RankCores::RankCores(unsigned ranks, unsigned cores, Done done, Arrived arrived)
    : cores_(cores), done_(std::move(done)), arrived_(std::move(arrived)), ranks_(ranks) {}

void RankCores::start(TaskKind kind, unsigned rank, double seconds, std::uint32_t subject) {
  std::uint32_t number = static_cast<std::uint32_t>(tasks_.size());
  if (free_tasks_.empty()) {
    tasks_.emplace_back();
  } else {
    number = free_tasks_.back();
    free_tasks_.pop_back();
  }
  Task& task = tasks_[number];
  task.left = seconds;
  task.subject = subject;
  task.rank = rank;
  task.kind = kind;
  ranks_[rank].seconds[index(kind)] += seconds;
  ranks_[rank].waiting[index(kind)].push_back(number);
  dispatch(rank);
}

void RankCores::wait_until(double time, std::uint32_t subject) {
  events_.push({time, next_number_++, subject, 0, false});
}

bool RankCores::give_way(Rank& rank, std::size_t to) {
  for (std::size_t kind = kTaskKinds; --kind > to;) {
    if (rank.running[kind].empty()) continue;
    const std::uint32_t number = rank.running[kind].back();
    rank.running[kind].pop_back();
    Task& task = tasks_[number];
    task.left -= now_ - task.began;
    ++task.turn;
    rank.waiting[kind].push_front(number);
    return true;
  }
  return false;
}

void RankCores::dispatch(unsigned number) {
  Rank& rank = ranks_[number];
  for (std::size_t kind = 0; kind < kTaskKinds; ++kind) {
    const std::size_t most = kind == index(TaskKind::kMessage) ? 1 : cores_;
    while (!rank.waiting[kind].empty() && rank.running[kind].size() < most) {
      std::size_t busy = 0;
      for (const auto& running : rank.running) busy += running.size();
      if (busy == cores_ && !give_way(rank, kind)) return;
      const std::uint32_t next = rank.waiting[kind].front();
      rank.waiting[kind].pop_front();
      rank.running[kind].push_back(next);
      tasks_[next].began = now_;
      events_.push({now_ + tasks_[next].left, next_number_++, next, tasks_[next].turn, true});
    }
  }
}

bool RankCores::step() {
  if (events_.empty()) return false;
  const Event event = events_.top();
  events_.pop();
  if (!event.is_task) {
    now_ = event.time;
    arrived_(event.subject);
    return true;
  }
  Task& task = tasks_[event.subject];
  if (task.turn != event.turn) return true;  // It gave way before.
  now_ = event.time;
  ++task.turn;
  std::erase(ranks_[task.rank].running[index(task.kind)], event.subject);
  const Task done = task;
  free_tasks_.push_back(event.subject);
  done_(done.kind, done.rank, done.subject);
  dispatch(done.rank);
  return true;
}

}  // namespace hiprt::bench
