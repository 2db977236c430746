#include <tools/scene_io/scene/scene_motion.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace hiprt::tools {
namespace {

using Columns = std::array<std::array<double, 3>, 3>;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

std::array<double, 3> cross(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double length(const std::array<double, 3>& a) { return std::sqrt(dot(a, a)); }

bool hides(const build::MotionKey& key) {
  return std::all_of(std::begin(key.scale), std::end(key.scale), [](float x) { return x == 0.0f; }) &&
         std::all_of(std::begin(key.shear), std::end(key.shear), [](float x) { return x == 0.0f; });
}

bool hides(const build::MatrixKey& key) {
  const auto& rows = key.to_scene.row;
  return std::all_of(std::begin(rows), std::end(rows),
                     [](const auto& row) { return row[0] == 0.0f && row[1] == 0.0f && row[2] == 0.0f; });
}

/// A direction at a right angle to the other columns. @param axis of the column: after the next two it is right-handed.
std::array<double, 3> missing_direction(const Columns& columns, std::size_t axis) {
  const auto &a = columns[(axis + 1) % 3], &b = columns[(axis + 2) % 3];
  std::array<double, 3> result = cross(a, b);
  if (length(result) > 1e-9 * length(a) * length(b)) return result;
  // The others are one line or a point: any direction beside it.
  const auto& line = length(a) > length(b) ? a : b;
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::abs(line[k]) < std::abs(line[least])) least = k;
  std::array<double, 3> unit{};
  unit[least] = 1;
  return length(line) > 0 ? cross(line, unit) : unit;
}

/// Makes columns that lie in the span of the others stand out of it by a thickness.
bool thicken(build::MatrixKey& key) {
  if (hides(key)) return false;
  auto& rows = key.to_scene.row;
  Columns columns{};
  double largest = 0;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) {
      columns[column][row] = static_cast<double>(rows[row][column]);
      largest = std::max(largest, std::abs(columns[column][row]));
    }
  if (!std::isfinite(largest)) return false;  // The builder refuses it.
  bool flat = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::array<double, 3> out = missing_direction(columns, axis);
    const double across = dot(columns[axis], out) / length(out);
    if (std::abs(across) >= kFlat * largest) continue;
    flat = true;
    for (std::size_t k = 0; k < 3; ++k) columns[axis][k] += (kFlatThickness * largest - across) * out[k] / length(out);
  }
  for (std::size_t row = 0; flat && row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) rows[row][column] = static_cast<float>(columns[column][row]);
  return flat;
}

/// The sign of a scale is that of the other keys, because no motion may mirror on its way.
bool thicken(build::MotionKey& key, const std::vector<build::MotionKey>& keys) {
  float largest = 0;
  for (const float scale : key.scale) largest = std::max(largest, std::abs(scale));
  if (largest == 0) return false;  // It hides the instance, or the builder refuses it for its shear.
  bool flat = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::abs(key.scale[axis]) >= static_cast<float>(kFlat) * largest) continue;
    flat = true;
    const auto other =
        std::find_if(keys.begin(), keys.end(), [&](const build::MotionKey& each) { return each.scale[axis] != 0.0f; });
    const float size = static_cast<float>(kFlatThickness) * largest;
    key.scale[axis] = other != keys.end() ? std::copysign(size, other->scale[axis]) : size;
  }
  return flat;
}

bool is_hidden(const build::Motion& motion) {
  const auto all = [](const auto& keys) {
    return std::all_of(keys.begin(), keys.end(), [](const auto& key) { return hides(key); });
  };
  return all(motion.keys) && all(motion.matrices);
}

std::uint64_t repair(build::Motion& motion) {
  std::uint64_t flat = 0;
  for (build::MatrixKey& key : motion.matrices) flat += thicken(key) ? 1 : 0;
  const std::vector<build::MotionKey> before = motion.keys;
  for (build::MotionKey& key : motion.keys) flat += thicken(key, before) ? 1 : 0;
  return flat;
}

}  // namespace

RepairedMotions repair_motions(SceneDescription& scene) {
  RepairedMotions result;
  std::vector<std::pair<const build::Motion*, std::uint64_t>> repaired;
  for (const auto& motion : scene.motions)
    if (const std::uint64_t flat = repair(*motion); flat != 0) repaired.emplace_back(motion.get(), flat);
  for (const auto& [motion, flat] : repaired) result.flat_keys += flat;
  for (SceneGroup& group : scene.groups)
    for (std::size_t i = 0; i < group.instances.size(); ++i) {
      build::Instance& instance = group.instances[i];
      if (instance.motion == nullptr) continue;
      const bool flat = std::any_of(repaired.begin(), repaired.end(),
                                    [&](const auto& each) { return each.first == instance.motion; });
      if (flat && result.first.empty()) result.first = group.location + "[" + std::to_string(i) + "]";
      if (!is_hidden(*instance.motion)) continue;
      instance.motion = nullptr;
      instance.to_scene = {};
      instance.mask = 0;
    }
  return result;
}

}  // namespace hiprt::tools
