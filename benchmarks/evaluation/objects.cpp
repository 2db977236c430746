#include "competitor.h"

#include <atomic>
#include <mutex>

namespace hiprt::bench {
namespace {

/// As in tools/build/build_scene.cpp: with more threads they wait for each other.
constexpr std::uint64_t kSmallObject = 1u << 17;

}  // namespace

build::Result<void> for_each_object(const Hierarchy& hierarchy, const tools::ThreadLimit& limit,
                                    const std::function<build::Result<void>(std::size_t, unsigned)>& build) {
  const std::size_t count = hierarchy.source->objects.size();
  std::mutex reporting;
  std::atomic<bool> failed = false;
  std::size_t failed_object = count;
  build::Error error{};
  const auto build_one = [&](std::size_t i, unsigned threads) {
    if (failed) return;
    const auto built = build(i, threads);
    if (built) return;
    const std::lock_guard lock(reporting);
    if (i > failed_object) return;
    failed = true;
    failed_object = i;
    error = {built.error().code, hierarchy.source->objects[i].name + ": " + built.error().message};
  };
  std::vector<std::size_t> small;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t triangles = 0;
    for (const std::size_t mesh : hierarchy.source->objects[i].meshes)
      triangles += hierarchy.source->meshes[mesh].triangles.size();
    if (triangles < kSmallObject && limit.threads() > 1)
      small.push_back(i);
    else
      build_one(i, limit.threads());
  }
  tools::parallel_batches(small.size(), 1, limit, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) build_one(small[i], 1);
  });
  if (failed) return tl::unexpected(std::move(error));
  return {};
}

}  // namespace hiprt::bench
