#include "competitor.h"
#include "host_trace.h"

#include <benchmarks/common/rounds.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/statistics.h>
#include <tools/build/gpu_builder.h>
#include <tools/cli/build/build_names.h>
#include <tools/render/scene/trace_limits.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <utility>

namespace hiprt::bench {
namespace {

/// Our BVHs. Builds leave them in the host's memory.
class HiprtCompetitor : public Competitor {
 public:
  HiprtCompetitor(const std::string& name, const Hierarchy& hierarchy, const tools::ThreadLimit& limit)
      : Competitor("hiprt", name, hierarchy), limit_(limit), kind_(tools::value_of(tools::kBuilders, name)) {}

  build::Result<BuildSeconds> build() override {
    if (auto can = check_form(); !can) return tl::unexpected(std::move(can.error()));
    BuildSeconds seconds;
    auto bvh = hierarchy().levels == 0 ? build_flat(seconds) : build_instanced(seconds);
    if (!bvh) return tl::unexpected(std::move(bvh.error()));
    file_ = std::move(bvh->buffer);
    buffer_view_ = *open_buffer(std::as_const(file_).bytes());
    view_ = make_scene_view(buffer_view_);
    return seconds;
  }

  TreeFigures figures() const override {
    TreeFigures figures;
    figures.bytes = file_.size();
    if (hierarchy().levels == 0) figures.sah_cost = build::measure_tree(buffer_view_).sah_cost;
    return figures;
  }

  const SceneView* view() const override { return &view_; }

 protected:
  /// Checks before the build that the device can trace the hierarchy.
  virtual build::Result<void> check_form() const { return {}; }
  /// Builds one BVH over meshes. @param seconds the build time is added; several threads call this.
  virtual build::Result<build::Bvh> build_meshes(std::span<const build::TriangleMesh> meshes, unsigned threads,
                                                 double& seconds) const = 0;
  /// Builds the BVHs of all objects. @param seconds their total time.
  virtual build::Result<void> build_objects(std::vector<build::Buffer>& files, double& seconds) const = 0;

  build::Builder kind() const { return kind_; }
  const BufferView& buffer_view() const { return buffer_view_; }
  const tools::ThreadLimit& limit() const { return limit_; }

 private:
  build::Result<build::Bvh> build_flat(BuildSeconds& seconds) const {
    return build_meshes(tools::views(hierarchy().geometries), limit_.threads(), seconds.objects);
  }

  build::Result<build::Bvh> build_instanced(BuildSeconds& seconds) const {
    std::vector<build::Buffer> files(hierarchy().source->objects.size());
    if (auto built = build_objects(files, seconds.objects); !built) return tl::unexpected(std::move(built.error()));
    std::vector<std::span<const std::byte>> objects;
    objects.reserve(files.size());
    std::vector<std::span<const build::Instance>> groups;
    for (const build::Buffer& file : files) objects.push_back(file.bytes());
    for (const tools::SceneGroup& group : hierarchy().groups) groups.emplace_back(group.instances);
    build::InstanceOptions options;
    options.tree.threads = limit_.threads();
    std::optional<build::Result<build::Bvh>> bvh;
    seconds.instances = time_of([&] {
      bvh.emplace(build::build_instances(build::InstancedScene{objects, groups}, options));
    });
    return std::move(*bvh);
  }

  const tools::ThreadLimit& limit_;
  build::Builder kind_;
  build::Buffer file_;
  BufferView buffer_view_{};
  SceneView view_{};
};

class CpuCompetitor : public HiprtCompetitor {
 public:
  using HiprtCompetitor::HiprtCompetitor;

  build::Result<void> prepare() override { return {}; }
  build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) override {
    return trace_on_host(*view(), any_hit, rays, hits, limit());
  }

 protected:
  build::Result<build::Bvh> build_meshes(std::span<const build::TriangleMesh> meshes, unsigned threads,
                                         double& seconds) const override {
    std::optional<build::Result<build::Bvh>> bvh;
    seconds = time_of([&] { bvh.emplace(build::build(meshes, {.builder = kind(), .threads = threads})); });
    return std::move(*bvh);
  }

  build::Result<void> build_objects(std::vector<build::Buffer>& files, double& seconds) const override {
    build::Result<void> done;
    seconds = time_of([&] {
      done = for_each_object(hierarchy(), limit(), [&](std::size_t i, unsigned threads) -> build::Result<void> {
        double ignored = 0;
        auto bvh = build_meshes(hierarchy().object(i), threads, ignored);
        if (!bvh) return tl::unexpected(std::move(bvh.error()));
        files[i] = std::move(bvh->buffer);
        return {};
      });
    });
    return done;
  }
};

class GpuCompetitor : public HiprtCompetitor {
 public:
  using HiprtCompetitor::HiprtCompetitor;

  build::Result<void> prepare() override {
    auto tracer = tools::GpuTracer::make(buffer_view());
    if (!tracer) return tl::unexpected(std::move(tracer.error()));
    tracer_.emplace(std::move(*tracer));
    return {};
  }

  build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) override {
    return tracer_->trace(any_hit ? tools::Query::kAny : tools::Query::kClosest, {}, rays, hits);
  }

 protected:
  build::Result<void> check_form() const override {
    if (hierarchy().levels <= tools::kTraceLevels) return {};
    return tl::unexpected(
        build::Error{build::ErrorCode::kNoDevice, std::to_string(hierarchy().levels) +
                                                      " levels of instances, but the kernels for GPUs support " +
                                                      std::to_string(tools::kTraceLevels) + " at most"});
  }

  build::Result<build::Bvh> build_meshes(std::span<const build::TriangleMesh> meshes, unsigned,
                                         double& seconds) const override {
    auto bvh = tools::build_on_gpu(meshes, {.builder = kind()});
    if (bvh) seconds = bvh->statistics.tree_seconds;
    return bvh;
  }

  build::Result<void> build_objects(std::vector<build::Buffer>& files, double& seconds) const override {
    for (std::size_t i = 0; i < files.size(); ++i) {
      double one = 0;
      auto bvh = build_meshes(hierarchy().object(i), 0, one);
      if (!bvh)
        return tl::unexpected(
            build::Error{bvh.error().code, hierarchy().source->objects[i].name + ": " + bvh.error().message});
      seconds += one;
      files[i] = std::move(bvh->buffer);
    }
    return {};
  }

 private:
  std::optional<tools::GpuTracer> tracer_;
};

}  // namespace

std::unique_ptr<Competitor> make_hiprt(const std::string& name, const Hierarchy& hierarchy, const Machine& machine) {
  if (machine.gpu) return std::make_unique<GpuCompetitor>(name, hierarchy, machine.limit);
  return std::make_unique<CpuCompetitor>(name, hierarchy, machine.limit);
}

}  // namespace hiprt::bench
