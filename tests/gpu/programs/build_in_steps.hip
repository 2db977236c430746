#include <hiprt_build/gpu/build_steps.h>

#include <cstdio>

using namespace hiprt;

int main() {
  gpu::DeviceAllocator memory;
  const build::Position corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const build::Triangle indices[] = {{0, 1, 2}, {1, 3, 2}};
  const auto positions = gpu::DeviceArray<build::Position>::from(corners, nullptr, memory);
  const auto triangles = gpu::DeviceArray<build::Triangle>::from(indices, nullptr, memory);
  if (!positions || !triangles) return 1;
  const gpu::DeviceGeometry mesh{
      .positions = positions->data(), .triangles = triangles->data(), .position_count = 4, .primitive_count = 2};
  auto steps = gpu::BuildSteps::make({&mesh, 1}, {.builder = build::Builder::kSbvh});
  if (!steps) return std::puts(steps.error().message.c_str());
  gpu::DeviceBuffer scene;
  while (!steps->done()) {
    auto output = gpu::DeviceBuffer::make(steps->sizes().output, nullptr, memory);
    auto scratch = gpu::DeviceBuffer::make(steps->sizes().scratch, nullptr, memory);
    if (!output || !scratch || !steps->enqueue(output->data(), scratch->data(), nullptr)) return 1;
    // The host is free here.
    if (!steps->wait()) return 1;
    scene = std::move(*output);  // This ends the life of the output before.
  }
  std::printf("%u leaves\n", steps->report().leaves);
}
