#pragma once
/// What the benchmarks of scenes of instances are made of.

#include <hiprt_build/gpu/instances.h>

#include <charconv>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace hiprt::bench {

struct Ball {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
};

/// A ball of 2 * rings * columns triangles.
inline Ball make_ball(unsigned rings, unsigned columns) {
  Ball ball;
  for (unsigned ring = 0; ring <= rings; ++ring)
    for (unsigned column = 0; column < columns; ++column) {
      const float latitude = 3.14159265f * (static_cast<float>(ring) / static_cast<float>(rings) - 0.5f);
      const float longitude = 6.2831853f * static_cast<float>(column) / static_cast<float>(columns);
      ball.positions.push_back(
          {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)});
      const std::uint32_t here = ring * columns + column, next = ring * columns + (column + 1) % columns;
      if (ring == rings) continue;
      ball.triangles.push_back({here, next, next + columns});
      ball.triangles.push_back({here, next + columns, here + columns});
    }
  return ball;
}

/// Random rotations and scales, in a cube in which a tenth of the instances touch another.
inline std::vector<gpu::DeviceInstance> make_instances(std::uint32_t count, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto number = [&] { return 2.0f * static_cast<float>(random() >> 8) * 0x1p-24f - 1.0f; };
  const float half = 2.0f * std::cbrt(static_cast<float>(count));
  std::vector<gpu::DeviceInstance> instances(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    build::MotionKey key;
    for (float& x : key.translation) x = half * number();
    for (float& x : key.rotation) x = number();
    key.rotation[3] += 0.01f;
    for (float& scale : key.scale) scale = 1.0f + 0.4f * number();
    instances[i] = {.to_scene = build::compose(key).to_scene, .id = i};
  }
  return instances;
}

/// @return 0 if the text is no valid count.
inline std::uint32_t parse_count(const std::string& text) {
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc() && end == text.data() + text.size() && count < gpu::kMaxBuildPrimitives ? count : 0;
}

}  // namespace hiprt::bench
