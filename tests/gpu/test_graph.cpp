// Work captured in a graph: repeated launches give the bytes of a launch on a stream.

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/gpu/refit.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261121;
using Bytes = std::vector<std::byte>;

/// A new stream: the default stream cannot be captured.
class Stream {
 public:
  Stream() { REQUIRE(hipStreamCreateWithFlags(&stream_, hipStreamNonBlocking) == hipSuccess); }
  ~Stream() { static_cast<void>(hipStreamDestroy(stream_)); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  operator hipStream_t() const { return stream_; }
  void wait() const { REQUIRE(hipStreamSynchronize(stream_) == hipSuccess); }

 private:
  hipStream_t stream_ = nullptr;
};

/// Ends the whole program where the runtime has no graphs: amdrun's has not.
void begin_capture(hipStream_t stream) {
  const hipError_t begun = hipStreamBeginCapture(stream, hipStreamCaptureModeGlobal);
  if (begun == hipErrorNotSupported) {
    std::puts("SKIPPED: hipStreamBeginCapture is not supported here (amdrun has no graphs)");
    std::fflush(stdout);
    std::_Exit(77);
  }
  REQUIRE(begun == hipSuccess);
}

/// What work(stream) puts on the stream.
class Graph {
 public:
  template <class Work> Graph(hipStream_t stream, const Work& work) {
    begin_capture(stream);
    work(stream);
    REQUIRE(hipStreamEndCapture(stream, &graph_) == hipSuccess);
    REQUIRE(hipGraphInstantiateWithFlags(&instance_, graph_, 0) == hipSuccess);
  }
  ~Graph() {
    static_cast<void>(hipGraphExecDestroy(instance_));
    static_cast<void>(hipGraphDestroy(graph_));
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  void launch(hipStream_t stream) const { REQUIRE(hipGraphLaunch(instance_, stream) == hipSuccess); }

 private:
  hipGraph_t graph_ = nullptr;
  hipGraphExec_t instance_ = nullptr;
};

/// A mesh on the device, whose vertices can move.
class MovingMesh {
 public:
  explicit MovingMesh(oracle::Mesh mesh)
      : mesh_(std::move(mesh)),
        positions_(must(gpu::DeviceArray<build::Position>::from(mesh_.positions, nullptr, allocator_))),
        triangles_(must(gpu::DeviceArray<build::Triangle>::from(mesh_.triangles, nullptr, allocator_))) {
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  gpu::DeviceGeometry geometry() const {
    return {.positions = positions_.data(),
            .triangles = triangles_.data(),
            .position_count = static_cast<std::uint32_t>(positions_.size()),
            .primitive_count = static_cast<std::uint32_t>(triangles_.size())};
  }
  const oracle::Mesh& mesh() const { return mesh_; }
  void move(double turn) {
    must(positions_.upload(oracle::twisted(mesh_, turn).positions, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

 private:
  CountingAllocator allocator_;
  oracle::Mesh mesh_;
  gpu::DeviceArray<build::Position> positions_;
  gpu::DeviceArray<build::Triangle> triangles_;
};

/// Everything in the memory.
Bytes download(const gpu::DeviceBuffer& buffer) {
  Bytes bytes(buffer.size());
  must(buffer.download(bytes, nullptr));
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  return bytes;
}

/// The graph of work(stream), launched twice while what it reads moves, leaves result() as the work itself does. It is
/// captured before anything has run. @param clear brings all memory into the state that the work begins with.
template <class Moving, class Work, class Clear, class Result>
void check_graph(Moving& moving, const Work& work, const Clear& clear, const Result& result) {
  const Stream stream;
  const Graph graph(stream, work);
  std::vector<Bytes> wanted;
  for (const double turn : {0.5, -1.5}) {
    moving.move(turn);
    clear();
    graph.launch(stream);
    stream.wait();
    const Bytes from_graph = result();
    clear();
    work(stream);
    stream.wait();
    wanted.push_back(result());
    CHECK((from_graph == wanted.back()));
  }
  CHECK((wanted[0] != wanted[1]));
}

/// Memory whose bytes are all the same to begin with.
struct Memory {
  CountingAllocator allocator;
  gpu::DeviceBuffer output, scratch;

  explicit Memory(const gpu::BuildSizes& sizes)
      : output(must(gpu::DeviceBuffer::make(sizes.output, nullptr, allocator))),
        scratch(must(gpu::DeviceBuffer::make(sizes.scratch, nullptr, allocator))) {
    clear();
  }
  void clear() {
    must(output.fill(std::byte{0xa5}, nullptr));
    must(scratch.fill(std::byte{0xa5}, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }
};

}  // namespace

TEST_CASE("a build in a graph") {
  MovingMesh mesh(oracle::star(4, kSeed));
  for (const build::Builder builder : {build::Builder::kHploc, build::Builder::kLbvh}) {
    INFO(build::name(builder));
    const gpu::DeviceGeometry geometry = mesh.geometry();
    const gpu::BuildOptions options{.builder = builder};
    Memory memory(must(gpu::build_sizes({&geometry, 1}, options)));
    const gpu::BuildReport* report = nullptr;
    const auto work = [&](hipStream_t stream) {
      report = must(gpu::enqueue_build({&geometry, 1}, options, memory.output.data(), memory.scratch.data(), stream));
    };
    // The bytes between the sections are anything.
    const auto file = [&] {
      const gpu::BuiltScene scene = must(gpu::compact(report, nullptr, memory.allocator));
      const build::Buffer buffer = must(gpu::download_file(scene, "test_graph", nullptr));
      return Bytes(buffer.bytes().begin(), buffer.bytes().end());
    };
    check_graph(
        mesh, work, [&] { memory.clear(); }, file);
  }
}

TEST_CASE("a batch in a graph") {
  MovingMesh mesh(oracle::star(4, kSeed));
  // Blocks of both sizes: every mesh a part of the star.
  std::vector<std::uint32_t> first{0};
  while (first.back() < mesh.mesh().triangles.size())
    first.push_back(std::min(first.back() + 1 + static_cast<std::uint32_t>(first.size() * 37 % 200),
                             static_cast<std::uint32_t>(mesh.mesh().triangles.size())));
  CountingAllocator allocator;
  const auto device_first = must(gpu::DeviceArray<std::uint32_t>::from(first, nullptr, allocator));
  const gpu::DeviceGeometry geometry = mesh.geometry();
  const gpu::DeviceBatch batch{geometry.positions, geometry.triangles, geometry.position_count, first,
                               device_first.data()};
  Memory memory(must(gpu::batch_sizes(batch)));
  const auto work = [&](hipStream_t stream) {
    must(gpu::enqueue_batch(batch, {}, memory.output.data(), memory.scratch.data(), stream));
  };
  check_graph(
      mesh, work, [&] { memory.clear(); }, [&] { return download(memory.output); });
}

TEST_CASE("a refit in a graph") {
  MovingMesh mesh(oracle::star(4, kSeed));
  CountingAllocator allocator;
  const gpu::DeviceGeometry geometry = mesh.geometry();
  gpu::BuiltScene scene = must(gpu::build_scene({&geometry, 1}, {}, nullptr, allocator));
  const Bytes built = download(scene.buffer);
  const gpu::SceneParts parts = gpu::parts_of(scene);
  auto scratch = must(gpu::DeviceBuffer::make(gpu::refit_scratch(parts), nullptr, allocator));
  const gpu::RefitReport* report = nullptr;
  const auto work = [&](hipStream_t stream) {
    report = must(gpu::enqueue_refit(parts, {&geometry, 1}, scratch.data(), stream));
  };
  const auto clear = [&] {
    must(scene.buffer.upload(built, nullptr));
    must(scratch.fill(std::byte{0xa5}, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  };
  const auto refitted = [&] {
    gpu::RefitReport result;
    REQUIRE(hipMemcpy(&result, report, sizeof(result), hipMemcpyDeviceToHost) == hipSuccess);
    CHECK(result.status == gpu::RefitStatus::kOk);
    return download(scene.buffer);
  };
  check_graph(mesh, work, clear, refitted);
}

namespace {

/// Instances on the device that move along x.
class MovingInstances {
 public:
  MovingInstances() : instances_(must(gpu::DeviceArray<gpu::DeviceInstance>::make(kCount, nullptr, allocator_))) {
    move(0);
  }
  static constexpr std::uint32_t kCount = 100;

  gpu::DeviceInstances view() const { return {instances_.data(), kCount}; }
  void move(double by) {
    std::vector<gpu::DeviceInstance> instances(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i)
      instances[i].to_scene.row[0][3] = static_cast<float>(by * (i % 10) + 3 * i);
    must(instances_.upload(instances, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

 private:
  CountingAllocator allocator_;
  gpu::DeviceArray<gpu::DeviceInstance> instances_;
};

}  // namespace

TEST_CASE("a tree over instances in a graph") {
  const auto object = must(build::build(oracle::views({oracle::star(4, kSeed)})));
  const std::vector<std::span<const std::byte>> files{object.buffer.bytes()};
  const std::vector<build::Instance> one(1);
  const build::Bvh file = must(build::build_instances(files, one));
  const BufferView view = *open_buffer(file.buffer.bytes());
  const gpu::BuildSizes sizes = must(gpu::instance_sizes(gpu::objects_in(view), MovingInstances::kCount));
  CountingAllocator allocator;
  gpu::DeviceScene scene = must(gpu::upload_scene(view, nullptr, allocator, sizes.output));
  auto scratch = must(gpu::DeviceBuffer::make(sizes.scratch, nullptr, allocator));
  const gpu::SceneObjects objects = gpu::objects_of(scene, view);
  MovingInstances instances;
  const gpu::InstanceReport* report = nullptr;
  const auto work = [&](hipStream_t stream) {
    report = must(gpu::enqueue_instances(objects, instances.view(), {}, scene.buffer.data(), scratch.data(), stream));
  };
  const auto clear = [&] {
    must(scratch.fill(std::byte{0xa5}, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  };
  const auto made = [&] {
    const gpu::InstanceReport read = must(gpu::read_report(report, objects, nullptr));
    const build::Buffer buffer = must(gpu::download_file(read, objects, nullptr));
    return Bytes(buffer.bytes().begin(), buffer.bytes().end());
  };
  check_graph(instances, work, clear, made);
}
