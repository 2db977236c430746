/// All orders in which the messages of a small run can come: each ends with the right hits.

#include <tests/amount.h>
#include <tests/catch.h>
#include <tools/render/parts/ray_tour.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace hiprt;
using namespace hiprt::tools;

namespace {

/// A run as a value: processes with a wave of rays each, and all messages on their way.
struct Model {
  struct Message {
    unsigned from, to;
    bool is_answer;
    RayTour::Parcel parcel;
    PartAnswer answer;
  };

  std::vector<RayTour> tours;  ///< Of each process.
  std::vector<std::vector<std::size_t>> credit;
  std::vector<Message> messages;  ///< On their way, or waiting at a process.
};

/// Explores all orders of steps from a state. Copies of tours share the arrays of hits, so a state is a list of steps
/// that is run from the start.
class Explorer {
 public:
  /// @param rays of each process.
  Explorer(const std::vector<ScenePart>& parts, std::vector<std::vector<Ray>> rays, std::size_t credit, Query query)
      : parts_(parts),
        router_(parts_),
        rays_(std::move(rays)),
        processes_(static_cast<unsigned>(rays_.size())),
        credit_(credit),
        query_(query) {}

  void run() {
    std::vector<unsigned> choices;
    explore(choices);
  }
  std::size_t ends() const { return ends_; }
  std::size_t states() const { return states_; }

 private:
  struct Wave {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> paths;
    std::vector<PathSurface> surfaces;
  };

  /// Part k has a hit for every ray at t = k + 2, but only for rays to the right of x = 0.
  static PartAnswer answer_of(std::uint32_t part, const RayTour::Parcel& parcel, Query query) {
    PartAnswer answer;
    answer.query = query;
    for (const Ray& ray : parcel.rays) {
      const float t = 2.0f + static_cast<float>(part);
      const bool hits = ray.origin.x > 0.0f && t <= ray.tmax;
      answer.results.push_back(hits ? VisitResult::kHit : VisitResult::kMiss);
      if (!hits || query == Query::kAny) continue;
      PartHit& hit = answer.hits.emplace_back();
      hit.hit.t = t;
      hit.hit.geometry = 0;
      hit.hit.primitive = part;
      answer.paths.push_back(part);
    }
    return answer;
  }

  /// Runs the steps of @p choices. @return how many steps may follow.
  std::size_t replay(const std::vector<unsigned>& choices, std::string& state) {
    std::vector<Wave> waves(processes_);
    Model model;
    model.credit.assign(processes_, std::vector<std::size_t>(processes_, credit_));
    for (unsigned p = 0; p < processes_; ++p) {
      const std::size_t count = rays_[p].size();
      waves[p] = {std::vector<Hit>(count), std::vector<std::uint32_t>(count, kInvalidId),
                  std::vector<PathSurface>(count)};
      model.tours.emplace_back(router_, query_, rays_[p],
                               TourHits{waves[p].hits.data(), waves[p].paths.data(), waves[p].surfaces.data(), 1});
    }
    for (const unsigned choice : choices) step(model, choice);
    state.clear();
    for (unsigned p = 0; p < processes_; ++p) {
      for (const Hit& hit : waves[p].hits) state += std::to_string(hit.primitive) + ",";
      for (std::uint32_t part = 0; part < parts_.size(); ++part)
        state += std::to_string(model.tours[p].ready(part)) + ";";
      for (const std::size_t free : model.credit[p]) state += std::to_string(free) + ":";
    }
    std::vector<std::string> on_way;
    for (const Model::Message& m : model.messages) {
      std::string text = std::to_string(m.from) + (m.is_answer ? "a" : "q") + std::to_string(m.parcel.part);
      for (const std::uint32_t ray : m.parcel.numbers) text += "." + std::to_string(ray);
      on_way.push_back(text);
    }
    std::sort(on_way.begin(), on_way.end());
    for (const std::string& text : on_way) state += "|" + text;
    const std::size_t next = enabled(model).size();
    if (next != 0) return next;
    // Nothing can happen: then everything must be done, and right.
    for (unsigned p = 0; p < processes_; ++p) {
      REQUIRE(model.tours[p].done());
      for (std::size_t i = 0; i < rays_[p].size(); ++i) {
        const bool hits = rays_[p][i].origin.x > 0.0f;
        REQUIRE(waves[p].hits[i].found() == hits);
        if (hits && query_ == Query::kClosest) {
          REQUIRE(waves[p].hits[i].t == 2.0f);
          REQUIRE(waves[p].paths[i] == 0);
        }
      }
      for (const std::size_t free : model.credit[p]) REQUIRE(free == credit_);
    }
    return 0;
  }

  /// The steps that may come next: (process, part) sends, or a message arrives.
  std::vector<std::pair<unsigned, unsigned>> enabled(const Model& model) const {
    std::vector<std::pair<unsigned, unsigned>> steps;
    for (unsigned p = 0; p < processes_; ++p)
      for (unsigned part = 0; part < parts_.size(); ++part)
        if (model.tours[p].ready(part) != 0 && (owner(part) == p || model.credit[p][owner(part)] != 0))
          steps.emplace_back(p, part);
    for (unsigned m = 0; m < model.messages.size(); ++m) steps.emplace_back(processes_, m);
    return steps;
  }
  unsigned owner(unsigned part) const { return part % processes_; }

  void step(Model& model, unsigned choice) const {
    const auto [p, what] = enabled(model)[choice];
    if (p < processes_) {
      const bool own = owner(what) == p;
      const std::size_t ready = model.tours[p].ready(what);
      const std::size_t most = own ? ready : std::min(ready, model.credit[p][owner(what)]);
      RayTour::Parcel parcel = model.tours[p].take(what, most);
      REQUIRE(parcel.numbers.size() == most);
      if (own) {
        REQUIRE(model.tours[p].give(parcel, answer_of(what, parcel, query_)));
        return;
      }
      model.credit[p][owner(what)] -= most;
      model.messages.push_back({p, owner(what), false, std::move(parcel), {}});
      std::size_t held = 0;
      for (const Model::Message& m : model.messages) held += m.to == owner(what) ? m.parcel.numbers.size() : 0;
      // What a process may have to hold: the rays of all others, and the answers to its own.
      REQUIRE(held <= 2 * (processes_ - 1) * credit_);
      return;
    }
    Model::Message message = std::move(model.messages[what]);
    model.messages.erase(model.messages.begin() + what);
    if (message.is_answer) {
      REQUIRE(model.tours[message.to].give(message.parcel, message.answer));
      model.credit[message.to][message.from] += message.parcel.numbers.size();
      return;
    }
    message.answer = answer_of(message.parcel.part, message.parcel, query_);
    message.is_answer = true;
    std::swap(message.from, message.to);
    model.messages.push_back(std::move(message));
  }

  void explore(std::vector<unsigned>& choices) {
    std::string state;
    const std::size_t next = replay(choices, state);
    if (!known_.insert(state).second) return;
    ++states_;
    if (next == 0) ++ends_;
    for (unsigned choice = 0; choice < next; ++choice) {
      choices.push_back(choice);
      explore(choices);
      choices.pop_back();
    }
  }

  std::vector<ScenePart> parts_;
  PartRouter router_;
  std::vector<std::vector<Ray>> rays_;
  unsigned processes_;
  std::size_t credit_;
  Query query_;
  std::set<std::string> known_;
  std::size_t ends_ = 0, states_ = 0;
};

}  // namespace

TEST_CASE("exchange: every order of the messages of a small run ends with the right hits, and no deadlock") {
  // Parts one behind the other in the rays' direction.
  std::vector<ScenePart> parts(3);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto z = 1.5f + static_cast<float>(k);
    parts[k].bounds = {{-10, -10, z}, {10, 10, z + 1.0f}};
    parts[k].boxes = {parts[k].bounds};
  }
  const auto ray = [](float x) {
    Ray result;
    result.origin = Vec3(x, 0, 0);
    result.direction = Vec3(0, 0, 1);
    return result;
  };
  std::size_t states = 0;
  const auto explore = [&](Query query, std::size_t credit, unsigned processes, unsigned rays) {
    CAPTURE(static_cast<int>(query), credit, processes, rays);
    std::vector<std::vector<Ray>> waves(processes);
    for (unsigned p = 0; p < processes; ++p)
      for (unsigned i = 0; i < rays; ++i) waves[p].push_back(ray(i == p % rays ? 1.0f : -1.0f));
    Explorer explorer(parts, waves, credit, query);
    explorer.run();
    CHECK(explorer.ends() == 1);
    states += explorer.states();
  };
  for (const Query query : {Query::kClosest, Query::kAny})
    for (const std::size_t credit : {1u, 2u}) {
      for (const unsigned rays : {1u, 2u, 3u}) explore(query, credit, 2, rays);
      explore(query, credit, 3, 1);
      if (checks::kWorkDivisor < 25) explore(query, credit, 3, 2);
    }
  std::printf("all orders of messages: %zu states\n", states);
}
