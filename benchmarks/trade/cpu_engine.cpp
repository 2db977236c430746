#include "places.h"

#include <benchmarks/common/embree_scene.h>
#include <benchmarks/common/machine.h>
#include <benchmarks/common/rounds.h>
#include <benchmarks/trace/embree_trace.h>
#include <hiprt_build/format/view.h>
#include <tests/oracle/embree_scene.h>
#include <tools/render/tracers/isa.h>
#include <tools/base/parallel.h>

#include <exception>
#include <memory>
#include <mutex>
#include <optional>

namespace hiprt::bench {

void tradeoff_ask_usual(CpuWork& work);
void tradeoff_ask_fast_math(CpuWork& work);

namespace {

constexpr std::size_t kBatch = 4096;

/// What ask() calls.
struct EmbreeTracer {
  RTCScene scene;

  Hit closest(const Ray& ray) const {
    Hit hit;
    embree_trace(scene, false, {&ray, 1}, {&hit, 1});
    return hit;
  }
};

/// Embree has one level of instances (Debian's), and slerp or matrices.
bool embree_has(const Place& place) {
  const build::Motion* motion = place.chain[0].motion;
  return place.chain.size() == 1 && (motion == nullptr || motion->kind != MotionKind::kNlerp);
}

/// @throw std::runtime_error from Embree.
std::unique_ptr<checks::EmbreeScene> embree_place(const Place& place, RTCSceneFlags flags) {
  checks::EmbreeScene object(flags);
  object.add(place.mesh);
  object.commit();
  auto scene = std::make_unique<checks::EmbreeScene>(flags);
  const build::Motion* motion = place.chain[0].motion;
  std::vector<build::Affine> matrices;
  if (motion == nullptr) matrices = {place.chain[0].to_scene};
  if (motion != nullptr && motion->kind == MotionKind::kMatrix)
    for (const build::MotionKey& key : motion->keys) matrices.push_back(build::compose(key).to_scene);
  if (matrices.empty())
    scene->add(object, motion->keys, {});
  else
    scene->add(object, matrices);
  scene->commit();
  return scene;
}

class CpuEngine final : public Engine {
 public:
  explicit CpuEngine(unsigned threads) : limit_(threads), subjects_(policy_subjects()) {
    for (const char* name : {"Embree", "Embree robust"}) {
      Subject subject;
      subject.name = name;
      subject.ours = false;
      subjects_.push_back(subject);
    }
  }

  nlohmann::json describe() const override {
    return {{"kind", "cpu"}, {"name", cpu_name()}, {"threads", limit_.threads()}};
  }

  const std::vector<Subject>& subjects() const override { return subjects_; }

  build::Result<void> set_model(const Model& model, const Trees& trees) override {
    model_ = &model;
    placed_.reset();
    placed_embree_ = {};
    for (std::size_t i = 0; i < kLayouts; ++i) {
      const auto view = open_buffer(trees[i].buffer.bytes());
      if (!view) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "a tree that is no file"});
      scenes_[i] = make_scene_view(*view);
    }
    embree_[0].reset();
    embree_[1].reset();
    for (const bool robust : {false, true}) {
      auto scene = EmbreeScene::make(model.mesh, {.flags = robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE});
      if (!scene) return tl::unexpected(scene.error());
      if (auto done = scene->commit(); !done) return done;
      embree_[robust ? 1 : 0].emplace(std::move(*scene));
    }
    return {};
  }

  build::Result<void> set_place(const Place& place) override {
    const auto view = open_buffer(place.file.bytes());
    if (!view) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "a scene that is no file"});
    model_ = &place.model;
    placed_ = make_scene_view(*view);
    placed_embree_[0].reset();
    placed_embree_[1].reset();
    for (const bool robust : {false, true}) {
      if (!embree_has(place)) break;
      try {
        placed_embree_[robust ? 1 : 0] = embree_place(place, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
      } catch (const std::exception& error) {
        return tl::unexpected(build::Error{build::ErrorCode::kBackend, error.what()});
      }
    }
    return {};
  }
  bool traces_place(const Subject& subject) const override {
    if (!subject.ours) return placed_embree_[subject.name == "Embree" ? 0 : 1] != nullptr;
    return subject.settings == Compiler::kUsual && kPolicySets[subject.set].layout == NodeLayout::kPlanes;
  }

  build::Result<Tally> ask(const Subject& subject, Probe probe, std::uint64_t count) override {
    aim(subject, probe);
    Tally sum;
    std::mutex mutex;
    const bool finished = tools::parallel_batches(count, kBatch, limit_, [&](std::size_t begin, std::size_t end) {
      const Tally part = ask_part(subject, probe, begin, end);
      const std::scoped_lock lock(mutex);
      sum.skipped += part.skipped;
      sum.faults += part.faults;
      sum.lost += part.lost;
      sum.folded += part.folded;
    });
    if (!finished) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "interrupted"});
    return sum;
  }

  build::Result<double> trace(const Subject& subject, std::span<const Ray> rays, std::span<Hit> hits) override {
    Probe probe;
    probe.question = Question::kTrace;
    aim(subject, probe);
    probe.target.rays = rays.data();
    probe.target.hits = hits.data();
    bool finished = true;
    const double seconds = time_of([&] {
      finished = tools::parallel_batches(rays.size(), kBatch, limit_, [&](std::size_t begin, std::size_t end) {
        ask_part(subject, probe, begin, end);
      });
    });
    if (!finished) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "interrupted"});
    return seconds;
  }

 private:
  void aim(const Subject& subject, Probe& probe) const {
    Target& target = probe.target;
    target.scene = placed_ ? *placed_ : scenes_[layout_index(kPolicySets[subject.set].layout)];
    target.positions = model_->mesh.positions.data();
    target.triangles = model_->mesh.triangles.data();
    target.triangle_count = static_cast<std::uint32_t>(model_->mesh.triangles.size());
    target.centre = model_->centre;
    target.room = model_->room;
    target.extent = model_->extent;
  }

  Tally ask_part(const Subject& subject, const Probe& probe, std::uint64_t begin, std::uint64_t end) const {
    CpuWork work{subject.set, &probe, placed_.has_value(), begin, end, {}};
    if (subject.ours) {
      (subject.settings == Compiler::kUsual ? tradeoff_ask_usual : tradeoff_ask_fast_math)(work);
      return work.tally;
    }
    const std::size_t mode = subject.name == "Embree" ? 0 : 1;
    const RTCScene scene = placed_ ? placed_embree_[mode]->get() : embree_[mode]->get();
    if (probe.question == Question::kTrace) {
      embree_trace(scene, false, {probe.target.rays + begin, end - begin}, {probe.target.hits + begin, end - begin});
      return {};
    }
    for (std::uint64_t i = begin; i < end; ++i) {
      const Tally one = oracle::ask(probe, i, EmbreeTracer{scene});
      work.tally.skipped += one.skipped;
      work.tally.faults += one.faults;
      work.tally.lost += one.lost;
      work.tally.folded += one.folded;
    }
    return work.tally;
  }

  tools::ThreadLimit limit_;
  std::vector<Subject> subjects_;
  const Model* model_ = nullptr;
  std::array<SceneView, kLayouts> scenes_{};
  std::optional<SceneView> placed_;
  std::array<std::unique_ptr<checks::EmbreeScene>, 2> placed_embree_;
  std::array<std::optional<EmbreeScene>, 2> embree_;
};

}  // namespace

build::Result<std::unique_ptr<Engine>> make_cpu_engine(unsigned threads) {
  if (!tools::runs_isa("x86_64_v3"))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, "the kernels want a processor with AVX2 and FMA"});
  return std::make_unique<CpuEngine>(threads);
}

}  // namespace hiprt::bench
