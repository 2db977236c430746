#include <tools/render/parts/part_exchange.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/render/path/cpu_path_engine.h>

#include <hiprt_build/format/out_of_memory.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

using std::chrono::milliseconds;

/// Between two looks for the end of the run.
constexpr milliseconds kLook{50};
/// Between two looks for credit while answers are missing, too.
constexpr milliseconds kShortLook{1};

}  // namespace

struct PartExchange::Call {
  /// A question without its answer.
  struct Waiting {
    std::uint32_t number;
    unsigned rank;
    RayTour::Parcel parcel;
  };

  Query query;
  RayTour tour;
  unsigned slot;
  const std::atomic<bool>& stopped;
  RayCounts& counts;
  std::vector<Waiting> waiting{};
};

PartExchange::PartExchange(Setup setup)
    : setup_(std::move(setup)),
      router_(setup_.manifest->parts),
      credit_(setup_.mail == nullptr ? 1 : setup_.mail->ranks(), setup_.credit) {
  if (setup_.mail == nullptr) return;
  for (unsigned i = 0; i < setup_.servers; ++i) servers_.emplace_back([this] { serve(); });
}

PartExchange::~PartExchange() { ended_ = true; }

build::Result<void> PartExchange::trace(Query query, std::span<const Ray> rays, const TourHits& hits,
                                        std::uint32_t* shared_paths, unsigned slot, const std::atomic<bool>& stopped,
                                        RayCounts& counts) {
  if (watcher_ != nullptr) watcher_->begin(query, rays.size());
  std::fill_n(hits.hits, rays.size(), Hit{});
  if (query == Query::kClosest) std::fill_n(hits.paths, rays.size() * hits.levels, kInvalidId);
  trace_shared(query, rays, hits, shared_paths);
  Call call{query, RayTour(router_, query, rays, hits), slot, stopped, counts};
  auto done = run(call);
  for (const Call::Waiting& question : call.waiting) credit_.give_back(question.rank, question.parcel.numbers.size());
  if (watcher_ != nullptr) watcher_->end();
  return done;
}

void PartExchange::trace_shared(Query query, std::span<const Ray> rays, const TourHits& hits,
                                std::uint32_t* shared_paths) const {
  const PathScene& scene = *setup_.shared;
  const std::uint32_t levels = scene.view.levels;
  if (scene.view.base == nullptr) return;
  const CpuPathEngine engine(scene, setup_.shared_alpha_cutout);
  static_cast<void>(engine.trace(query, rays.data(), static_cast<std::uint32_t>(rays.size()), hits.hits, shared_paths));
  if (query == Query::kAny) return;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits.hits[i].found()) continue;
    const std::span<const std::uint32_t> path(shared_paths + i * levels, levels);
    hits.surfaces[i] = surface_at(scene, rays[i], hits.hits[i], load_path(path));
    setup_.shared_numbers.to_scene(path, {hits.paths + i * hits.levels, hits.levels});
  }
}

build::Result<void> PartExchange::run(Call& call) {
  while (!call.tour.done()) {
    if (call.stopped || interrupted()) return fail(build::ErrorCode::kCancelled, "cancelled");
    // Rays to other processes leave first: these trace while this one does.
    const bool all_sent = send(call);
    const auto visited = visit_own(call);
    if (!visited) return tl::unexpected(visited.error());
    if (*visited) continue;
    if (call.waiting.empty()) {
      if (all_sent) continue;
      // Other threads have all credit. They get answers, and give it back.
      credit_.wait(kLook);
      if (auto health = setup_.mail->health(); !health) return health;
    } else {
      // All answers that are there, so that the next questions have more rays.
      milliseconds wait = all_sent ? kLook : kShortLook;
      for (bool more = true; more; wait = milliseconds(0)) {
        const auto received = receive(call, wait);
        if (!received) return tl::unexpected(received.error());
        more = *received;
      }
    }
  }
  return {};
}

/// Sends what there is credit for. @return false if rays are left.
bool PartExchange::send(Call& call) {
  bool all = true;
  for (std::uint32_t part = 0; part < setup_.owner.size(); ++part) {
    const std::size_t ready = setup_.tracers[part] != nullptr ? 0 : call.tour.ready(part);
    if (ready == 0) continue;
    const unsigned rank = setup_.owner[part];
    const std::size_t credit = credit_.take(rank, ready);
    all = all && credit == ready;
    if (credit == 0) continue;
    RayTour::Parcel parcel = call.tour.take(part, credit);
    const PartQuestion question{part, call.slot, ++numbers_, call.query, std::move(parcel.rays)};
    std::vector<std::byte> bytes = encode(question);
    call.counts.sent += credit;
    ++call.counts.messages;
    call.counts.bytes += bytes.size();
    setup_.mail->ask(rank, std::move(bytes));
    call.waiting.push_back({question.number, rank, std::move(parcel)});
  }
  return all;
}

/// Visits parts of this process. @return whether there were any rays for them.
build::Result<bool> PartExchange::visit_own(Call& call) const {
  bool any = false;
  for (std::uint32_t part = 0; part < setup_.tracers.size(); ++part) {
    const std::size_t ready = setup_.tracers[part] == nullptr ? 0 : call.tour.ready(part);
    if (ready == 0) continue;
    const RayTour::Parcel parcel = call.tour.take(part, ready);
    any = true;
    if (watcher_ != nullptr) watcher_->begin_visit();
    const auto answer = setup_.tracers[part]->trace(call.query, parcel.rays);
    if (!answer) return tl::unexpected(answer.error());
    if (watcher_ != nullptr) watcher_->end_visit(parcel, *answer);
    // It fits: the rays are the parcel's.
    static_cast<void>(call.tour.give(parcel, *answer));
  }
  return any;
}

/// Takes an answer. @return whether one came in time.
build::Result<bool> PartExchange::receive(Call& call, milliseconds wait) {
  const auto letter = setup_.mail->next_answer(call.slot, wait);
  if (!letter) {
    if (auto health = setup_.mail->health(); !health) return tl::unexpected(std::move(health.error()));
    return false;
  }
  ++call.counts.messages;
  call.counts.bytes += letter->bytes.size();
  auto answer = decode_answer(letter->bytes, setup_.manifest->levels);
  if (!answer) return tl::unexpected(std::move(answer.error()));
  const auto of = std::find_if(call.waiting.begin(), call.waiting.end(),
                               [&](const Call::Waiting& question) { return question.number == answer->number; });
  // To a trace() that was broken off.
  if (of == call.waiting.end()) return true;
  credit_.give_back(of->rank, of->parcel.numbers.size());
  const RayTour::Parcel parcel = std::move(of->parcel);
  call.waiting.erase(of);
  if (call.tour.give(parcel, answer->answer)) return true;
  return invalid_input("an answer of part " + std::to_string(parcel.part) + " does not fit its question");
}

void PartExchange::serve() {
  while (!ended_) {
    const auto letter = setup_.mail->next_question(kLook);
    if (!letter) continue;
    const auto question = decode_question(letter->bytes, setup_.tracers.size());
    if (!question) {
      // Which slot waits is not known. Any error ends the run.
      for (unsigned slot = 0; slot < RayMail::kMostSlots; ++slot)
        setup_.mail->answer(letter->from, slot, encode_fault(0, question.error()));
      continue;
    }
    setup_.mail->answer(letter->from, question->slot, answer_to(*question));
  }
}

std::vector<std::byte> PartExchange::answer_to(const PartQuestion& question) const {
  const auto& tracer = setup_.tracers[question.part];
  if (tracer == nullptr)
    return encode_fault(question.number, {build::ErrorCode::kInvalidInput, "part " + std::to_string(question.part) +
                                                                               " is in another process: do all "
                                                                               "ranks have the same manifest?"});
  try {
    const auto answer = tracer->trace(question.query, question.rays);
    return answer ? encode(question.number, *answer) : encode_fault(question.number, answer.error());
  } catch (const std::bad_alloc& failure) {
    return encode_fault(question.number, build::out_of_memory({"for rays of other processes"}, failure));
  }
}

}  // namespace hiprt::tools
