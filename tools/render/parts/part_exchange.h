#pragma once
/// Traces rays through a scene whose parts are in several processes.
///
/// A thread that has rays sends them to the processes with the parts that they may hit, and waits for answers. Other
/// threads of each process answer questions. They wait for no other process, so there is no deadlock
/// (docs/proofs/parts.md).

#include <tools/render/parts/part_tracer.h>
#include <tools/render/parts/ray_credit.h>
#include <tools/render/parts/ray_mail.h>
#include <tools/render/parts/ray_tour.h>
#include <tools/render/studio/render.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

namespace hiprt::tools {

/// Is told what PartExchange::trace() does, by the thread that called it. For measurements.
class TourWatcher {
 public:
  TourWatcher() = default;
  TourWatcher(const TourWatcher&) = delete;
  TourWatcher& operator=(const TourWatcher&) = delete;
  virtual ~TourWatcher() = default;

  virtual void begin(Query query, std::size_t rays) = 0;
  /// Before and after a visit to a part of this process.
  virtual void begin_visit() = 0;
  virtual void end_visit(const RayTour::Parcel& parcel, const PartAnswer& answer) = 0;
  virtual void end() = 0;
};

class PartExchange {
 public:
  struct Setup {
    const PartManifest* manifest = nullptr;            ///< Must live as long as the exchange.
    std::vector<unsigned> owner;                       ///< Rank that has each part.
    std::vector<std::unique_ptr<PartTracer>> tracers;  ///< Of each part; nullptr: another process has it.
    /// The scene that all processes have: lights and sky, and settings. Its view has the shared part's instances.
    const PathScene* shared = nullptr;
    bool shared_alpha_cutout = false;
    PathNumbers shared_numbers;  ///< Of its instances.
    RayMail* mail = nullptr;     ///< nullptr: this process has all parts.
    std::size_t credit = 0;      ///< Rays on their way to each other process, at least 1.
    unsigned servers = 1;        ///< Threads that answer questions.
  };

  explicit PartExchange(Setup setup);
  PartExchange(const PartExchange&) = delete;
  PartExchange& operator=(const PartExchange&) = delete;
  ~PartExchange();

  /// Traces rays through the whole scene. They have tmin 0 and all bits of the mask.
  /// @param hits of Query::kAny: found or not. Of Query::kClosest its paths are those of the whole scene.
  /// @param shared_paths of Query::kClosest: shared->view.levels numbers per ray. Of hits in the shared part the path
  /// in it; of other hits they have no meaning.
  /// @param slot that no other thread uses at the same time. @param stopped ends the call soon when it becomes true.
  /// @param counts messages to other processes and from them are added to it.
  /// @return the error of RayMail::health(), of a process that could not answer, or kCancelled if it was stopped or
  /// interrupted() is true.
  build::Result<void> trace(Query query, std::span<const Ray> rays, const TourHits& hits, std::uint32_t* shared_paths,
                            unsigned slot, const std::atomic<bool>& stopped, RayCounts& counts);

  const PartManifest& manifest() const { return *setup_.manifest; }
  /// @param watcher of all later calls of trace(). It must live as long as this. @pre One thread calls trace().
  void watch(TourWatcher& watcher) { watcher_ = &watcher; }

 private:
  /// The state of one call of trace().
  struct Call;

  void trace_shared(Query query, std::span<const Ray> rays, const TourHits& hits, std::uint32_t* shared_paths) const;
  build::Result<void> run(Call& call);
  build::Result<bool> visit_own(Call& call) const;
  bool send(Call& call);
  build::Result<bool> receive(Call& call, std::chrono::milliseconds wait);
  void serve();
  std::vector<std::byte> answer_to(const PartQuestion& question) const;

  Setup setup_;
  PartRouter router_;
  RayCredit credit_;
  TourWatcher* watcher_ = nullptr;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint32_t> numbers_ = 0;
  std::vector<std::jthread> servers_;
};

}  // namespace hiprt::tools
