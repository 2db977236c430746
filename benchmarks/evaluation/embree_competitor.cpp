#include "competitor.h"
#include "host_trace.h"

#include <benchmarks/common/rounds.h>
#include <benchmarks/trace/embree_trace.h>

#include <hiprt_build/embree/rtcore.h>

#include <array>
#include <atomic>
#include <cstring>
#include <utility>

namespace hiprt::bench {
namespace {

struct Mode {
  const char* name;
  RTCSceneFlags flags;
  RTCBuildQuality quality;
};
constexpr std::array<Mode, 3> kModes{{{"default", RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM},
                                      {"high", RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_HIGH},
                                      {"robust", RTC_SCENE_FLAG_ROBUST, RTC_BUILD_QUALITY_MEDIUM}}};

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<RTCDeviceTy, Release>;
using Scene = std::unique_ptr<RTCSceneTy, Release>;
using Geometry = std::unique_ptr<RTCGeometryTy, Release>;

class EmbreeCompetitor : public Competitor {
 public:
  EmbreeCompetitor(const Mode& mode, const Hierarchy& hierarchy, const tools::ThreadLimit& limit)
      : Competitor("embree", mode.name, hierarchy), mode_(mode), limit_(limit) {}

  build::Result<BuildSeconds> build() override {
    if (hierarchy().levels > RTC_MAX_INSTANCE_LEVEL_COUNT)
      return tl::unexpected(
          build::Error{build::ErrorCode::kTooLarge, std::to_string(hierarchy().levels) +
                                                        " levels of instances, but this Embree supports " +
                                                        std::to_string(RTC_MAX_INSTANCE_LEVEL_COUNT)});
    top_.reset();
    objects_.clear();
    if (auto made = make_device(); !made) return tl::unexpected(std::move(made.error()));
    BuildSeconds seconds;
    hierarchy().levels == 0 ? build_flat(seconds) : build_instanced(seconds);
    if (auto good = check("build"); !good) return tl::unexpected(std::move(good.error()));
    return seconds;
  }

  build::Result<void> prepare() override { return {}; }

  build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) override {
    const double seconds = trace_batches(rays, hits, limit_, [&](std::span<const Ray> part, std::span<Hit> part_hits) {
      embree_trace(top_.get(), any_hit, part, part_hits);
    });
    if (auto good = check("trace"); !good) return tl::unexpected(std::move(good.error()));
    return seconds;
  }

  TreeFigures figures() const override {
    TreeFigures figures;
    figures.bytes = static_cast<std::uint64_t>(bytes_.load());
    return figures;
  }
  const SceneView* view() const override { return nullptr; }

 private:
  static bool on_memory(void* user, ssize_t bytes, bool) {
    *static_cast<std::atomic<std::int64_t>*>(user) += bytes;
    return true;
  }

  build::Result<void> make_device() {
    if (device_ != nullptr) return {};
    device_.reset(rtcNewDevice(nullptr));
    if (device_ == nullptr)
      return tl::unexpected(build::Error{build::ErrorCode::kBackend,
                                         "Embree: rtcNewDevice error " + std::to_string(rtcGetDeviceError(nullptr))});
    rtcSetDeviceMemoryMonitorFunction(device_.get(), &on_memory, &bytes_);
    return {};
  }

  build::Result<void> check(const char* what) const {
    const RTCError error = rtcGetDeviceError(device_.get());
    if (error == RTC_ERROR_NONE) return {};
    const auto code = error == RTC_ERROR_OUT_OF_MEMORY ? build::ErrorCode::kOutOfMemory : build::ErrorCode::kBackend;
    return tl::unexpected(
        build::Error{code, std::string("Embree, ") + what + ": error " + std::to_string(static_cast<int>(error))});
  }

  Scene new_scene() const {
    Scene scene(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene.get(), mode_.flags);
    rtcSetSceneBuildQuality(scene.get(), mode_.quality);
    return scene;
  }

  /// Copies a mesh to Embree.
  void add(RTCScene scene, const build::TriangleMesh& mesh) const {
    const Geometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    void* positions = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              sizeof(build::Position), mesh.positions.size());
    void* triangles = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              sizeof(build::Triangle), mesh.triangles.size());
    if (positions == nullptr || triangles == nullptr) return;  // check() reports the error.
    std::memcpy(positions, mesh.positions.data(), mesh.positions.contiguous().size_bytes());
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.contiguous().size_bytes());
    rtcSetGeometryBuildQuality(geometry.get(), mode_.quality);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene, geometry.get());
  }

  void add(RTCScene scene, const build::Instance& instance) const {
    const Geometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(geometry.get(), objects_[instance.object].get());
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, &instance.to_scene);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene, geometry.get());
  }

  void build_flat(BuildSeconds& seconds) {
    top_ = new_scene();
    for (const build::TriangleMesh& mesh : tools::views(hierarchy().geometries)) add(top_.get(), mesh);
    seconds.objects = time_of([&] { rtcCommitScene(top_.get()); });
  }

  void build_instanced(BuildSeconds& seconds) {
    for (std::size_t i = 0; i < hierarchy().source->objects.size(); ++i) {
      objects_.push_back(new_scene());
      for (const build::TriangleMesh& mesh : hierarchy().object(i)) add(objects_.back().get(), mesh);
    }
    seconds.objects = time_of([&] {
      static_cast<void>(for_each_object(hierarchy(), limit_, [&](std::size_t i, unsigned) -> build::Result<void> {
        rtcCommitScene(objects_[i].get());
        return {};
      }));
    });
    top_ = new_scene();
    for (const build::Instance& instance : hierarchy().groups.back().instances) add(top_.get(), instance);
    seconds.instances = time_of([&] { rtcCommitScene(top_.get()); });
  }

  const Mode& mode_;
  const tools::ThreadLimit& limit_;
  std::atomic<std::int64_t> bytes_ = 0;  ///< Outlives the device, which reports to it.
  Device device_;
  std::vector<Scene> objects_;
  Scene top_;
};

}  // namespace

std::vector<std::string> embree_modes() {
  std::vector<std::string> names;
  names.reserve(kModes.size());
  for (const Mode& mode : kModes) names.emplace_back(mode.name);
  return names;
}

std::unique_ptr<Competitor> make_embree(const std::string& mode, const Hierarchy& hierarchy,
                                        const tools::ThreadLimit& limit) {
  const Mode* chosen = &kModes[0];
  for (const Mode& known : kModes)
    if (known.name == mode) chosen = &known;
  return std::make_unique<EmbreeCompetitor>(*chosen, hierarchy, limit);
}

}  // namespace hiprt::bench
