#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/instances/instance_fault.h>
#include <hiprt_build/instances/motion_keys.h>
#include <hiprt_build/instances/motion_segments.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace hiprt::build {
namespace {

/// Times in order, and far less than the largest float apart.
std::string fault_of_times(std::span<const float> times) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    const std::string key = "key " + std::to_string(i) + ": time " + text(times[i]);
    if (!std::isfinite(times[i])) return key + " is not finite";
    if (i > 0 && !(times[i] > times[i - 1])) return key + " is not after that of the key before, " + text(times[i - 1]);
    if (i > 0 && fault_between(times[i - 1], times[i]) != MotionFault::kNone)
      return key + " is too far from that of the key before";
  }
  return {};
}

MotionKey hidden_key(const MatrixKey& matrix) {
  MotionKey key{.time = matrix.time, .scale = {0, 0, 0}};
  for (unsigned r = 0; r < 3; ++r) key.translation[r] = matrix.to_scene.row[r][3];
  return key;
}

/// A zero matrix has no rotation: it gets that of the key before, or of the first one behind it that has one.
void turn_hidden(std::vector<MotionKey>& keys) {
  const auto visible = std::find_if(keys.begin(), keys.end(), [](const MotionKey& key) { return !hides(key); });
  if (visible == keys.end()) return;
  for (auto key = keys.begin(); key != keys.end(); ++key)
    if (hides(*key)) std::copy_n(key < visible ? visible->rotation : std::prev(key)->rotation, 4, key->rotation);
}

Result<std::vector<MotionKey>> keys_of(const Motion& motion) {
  if (motion.matrices.empty()) return motion.keys;
  std::vector<MotionKey> keys;
  for (std::size_t i = 0; i < motion.matrices.size(); ++i) {
    if (hides(motion.matrices[i])) {
      keys.push_back(hidden_key(motion.matrices[i]));
      continue;
    }
    auto key = decompose(motion.matrices[i]);
    if (!key) return tl::unexpected(invalid("key " + std::to_string(i) + ": " + key.error().message));
    keys.push_back(*key);
  }
  turn_hidden(keys);
  return keys;
}

const MatrixKey& to_matrix(const MatrixKey& key) { return key; }
MatrixKey to_matrix(const MotionKey& key) { return compose(key); }

/// The first key whose transform has an inverse that floats can hold; else the first one that does not hide the
/// instance. nullptr: all hide it.
template <class Key> const Key* first_visible(std::span<const Key> keys) {
  const Key* visible = nullptr;
  for (const Key& key : keys) {
    if (hides(key)) continue;
    if (is_invertible(to_matrix(key).to_scene)) return &key;
    if (visible == nullptr) visible = &key;
  }
  return visible;
}

/// Segments of a motion that turns. @return what is wrong, or nothing.
std::string add_turning(std::span<const MotionKey> keys, MotionKind kind, MotionParts& parts) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    MotionFault fault = fault_of(keys[i]);
    if (fault == MotionFault::kNone && i > 0) fault = fault_of_signs(keys[i - 1], keys[i]);
    if (fault != MotionFault::kNone) return describe_fault(fault, static_cast<std::uint32_t>(i), 0.0);
  }
  const MotionKey* const visible = first_visible(keys);
  if (visible == nullptr) return describe_fault(MotionFault::kHidden, 0, 0.0);
  parts.first = compose(*visible);
  Quaternion orientation = unit_rotation(keys[0]);
  for (std::size_t i = 1; i < keys.size(); ++i)
    parts.segments.push_back(make_segment(keys[i - 1], keys[i], kind, orientation));
  return {};
}

std::string add_matrices(std::span<const MatrixKey> keys, MotionParts& parts) {
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (!motion_keys_detail::is_finite(&keys[i].to_scene.row[0][0], 12))
      return describe_fault(MotionFault::kNotFinite, static_cast<std::uint32_t>(i), 0.0);
  const MatrixKey* const visible = first_visible(keys);
  if (visible == nullptr) return describe_fault(MotionFault::kHidden, 0, 0.0);
  parts.first = *visible;
  for (std::size_t i = 1; i < keys.size(); ++i) parts.segments.push_back(make_segment(keys[i - 1], keys[i]));
  return {};
}

}  // namespace

Result<MotionParts> make_motion(const Motion& motion) {
  if (motion.keys.empty() == motion.matrices.empty())
    return tl::unexpected(invalid("a motion has keys, or matrices, one of them at least"));
  if (motion.kind < MotionKind::kSlerp || motion.kind > MotionKind::kMatrix)
    return tl::unexpected(invalid("a motion of unknown kind " + std::to_string(static_cast<unsigned>(motion.kind))));
  std::vector<float> times;
  for (const MotionKey& key : motion.keys) times.push_back(key.time);
  for (const MatrixKey& key : motion.matrices) times.push_back(key.time);
  if (std::string fault = fault_of_times(times); !fault.empty()) return tl::unexpected(invalid(std::move(fault)));
  MotionParts parts;
  std::string fault;
  if (motion.kind == MotionKind::kMatrix) {
    std::vector<MatrixKey> matrices = motion.matrices;
    for (const MotionKey& key : motion.keys) matrices.push_back(compose(key));
    fault = add_matrices(matrices, parts);
  } else {
    auto keys = keys_of(motion);
    if (!keys) return tl::unexpected(std::move(keys.error()));
    fault = add_turning(*keys, motion.kind, parts);
  }
  if (!fault.empty()) return tl::unexpected(invalid(std::move(fault)));
  for (std::size_t i = 0; i < parts.segments.size(); ++i) {
    motion_detail::BadMatrix bad{};
    if (!magnify(parts.magnification, parts.segments[i], motion.kind, bad))
      return tl::unexpected(invalid(
          "between keys " + std::to_string(i) + " and " + std::to_string(i + 1) + ", at " + text(bad.s) +
          " of the way, the transform has no inverse that floats can hold: " + "determinant " + text(bad.determinant)));
  }
  return parts;
}

Result<MotionKey> decompose(const MatrixKey& key) {
  MotionKey result;
  const MotionFault fault = decompose_key(key, result);
  if (fault == MotionFault::kNone) return result;
  if (fault == MotionFault::kNotFinite) return tl::unexpected(invalid("the matrix is not finite"));
  float linear[3][3];
  for (unsigned r = 0; r < 3; ++r) std::copy_n(key.to_scene.row[r], 3, linear[r]);
  return tl::unexpected(invalid("the matrix has no inverse that floats can hold: determinant " +
                                text(LinearInverse(linear).determinant)));
}

MatrixKey compose(const MotionKey& key) { return compose_key(key); }

}  // namespace hiprt::build
