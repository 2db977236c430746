#include "host_trace.h"
#include "tree_builders.h"

#include <benchmarks/common/rounds.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/statistics.h>
#include <tools/cli/build/build_names.h>
#include <tools/render/scene/trace_limits.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <utility>

namespace hiprt::bench {
namespace {

/// Our BVHs. Builds leave them in the host's memory.
class HiprtCompetitor : public Competitor {
 public:
  HiprtCompetitor(const std::string& name, const Hierarchy& hierarchy, const Machine& machine)
      : Competitor("hiprt", name, hierarchy),
        limit_(machine.limit),
        tree_builder_(make_tree_builder(tools::value_of(tools::kBuilders, name), machine)) {}

  build::Result<BuildSeconds> build() override {
    if (auto can = check_form(); !can) return tl::unexpected(std::move(can.error()));
    BuildSeconds seconds;
    auto bvh =
        hierarchy().levels == 0 ? tree_builder_->build_flat(hierarchy(), seconds.objects) : build_instanced(seconds);
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

  const BufferView& buffer_view() const { return buffer_view_; }
  const tools::ThreadLimit& limit() const { return limit_; }
  const TreeBuilder& tree_builder() const { return *tree_builder_; }

 private:
  build::Result<build::Bvh> build_instanced(BuildSeconds& seconds) const {
    std::vector<build::Buffer> files(hierarchy().source->objects.size());
    if (auto built = tree_builder_->build_objects(hierarchy(), files, seconds.objects); !built)
      return tl::unexpected(std::move(built.error()));
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
  std::unique_ptr<TreeBuilder> tree_builder_;
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

  bool cpu_builds_for_gpu() const override { return tree_builder().on_cpu(); }

 protected:
  build::Result<void> check_form() const override {
    if (hierarchy().levels <= tools::kTraceLevels) return {};
    return tl::unexpected(
        build::Error{build::ErrorCode::kNoDevice, std::to_string(hierarchy().levels) +
                                                      " levels of instances, but the kernels for GPUs support " +
                                                      std::to_string(tools::kTraceLevels) + " at most"});
  }

 private:
  std::optional<tools::GpuTracer> tracer_;
};

}  // namespace

std::unique_ptr<Competitor> make_hiprt(const std::string& name, const Hierarchy& hierarchy, const Machine& machine) {
  if (machine.gpu) return std::make_unique<GpuCompetitor>(name, hierarchy, machine);
  return std::make_unique<CpuCompetitor>(name, hierarchy, machine);
}

}  // namespace hiprt::bench
