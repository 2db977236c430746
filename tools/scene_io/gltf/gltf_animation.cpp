#include <tools/scene_io/gltf/gltf_animation.h>

#include <tools/base/errors.h>
#include <tools/scene_io/gltf/gltf_accessor.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hiprt::tools {
namespace {

using Value = std::array<double, 4>;

double dot(const Value& a, const Value& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

Value blend(double wa, const Value& a, double wb, const Value& b) {
  Value result{};
  for (std::size_t i = 0; i < 4; ++i) result[i] = wa * a[i] + wb * b[i];
  return result;
}

Value unit(const Value& q) {
  const double length = std::sqrt(dot(q, q));
  return length > 0 ? blend(1 / length, q, 0, q) : q;
}

/// As the appendix of glTF 2.0 has it: along the shorter arc; nearly equal ones linearly.
Value slerp(const Value& a, const Value& b, double s) {
  const double cosine = dot(a, b), angle = std::acos(std::min(1.0, std::fabs(cosine)));
  const double sign = cosine < 0 ? -1.0 : 1.0;
  if (angle < 1e-6) return unit(blend(1 - s, a, sign * s, b));
  return blend(std::sin((1 - s) * angle) / std::sin(angle), a, sign * std::sin(s * angle) / std::sin(angle), b);
}

}  // namespace

Animation::Value Animation::Channel::key(std::size_t i, unsigned which) const {
  const std::size_t each = interpolation == Interpolation::kCubic ? 3 : 1;
  Value value{};
  std::copy_n(values.begin() + static_cast<std::ptrdiff_t>((i * each + which) * components()), components(),
              value.begin());
  return value;
}

Animation::Value Animation::Channel::at(double seconds) const {
  const bool cubic = interpolation == Interpolation::kCubic;
  const unsigned middle = cubic ? 1 : 0;
  const auto next = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), seconds) - times.begin());
  const auto finished = [&](const Value& value) { return path == Path::kRotation ? unit(value) : value; };
  if (next == 0) return finished(key(0, middle));
  if (next == times.size() || interpolation == Interpolation::kStep) return finished(key(next - 1, middle));
  const double length = times[next] - times[next - 1], s = (seconds - times[next - 1]) / length;
  const Value a = key(next - 1, middle), b = key(next, middle);
  if (!cubic) return path == Path::kRotation ? slerp(unit(a), unit(b), s) : blend(1 - s, a, s, b);
  // Hermite, with tangents per second.
  const double s2 = s * s, s3 = s2 * s;
  const Value ends = blend(2 * s3 - 3 * s2 + 1, a, 3 * s2 - 2 * s3, b);
  const Value tangents = blend(length * (s3 - 2 * s2 + s), key(next - 1, 2), length * (s3 - s2), key(next, 0));
  return finished(blend(1, ends, 1, tangents));
}

std::string Animation::Channel::set_kind(const std::string& target_path, const std::string& sampler_interpolation) {
  if (target_path == "translation")
    path = Path::kTranslation;
  else if (target_path == "rotation")
    path = Path::kRotation;
  else if (target_path == "scale")
    path = Path::kScale;
  else if (target_path == "weights")
    path = Path::kWeight;
  else
    return "unknown path '" + target_path + "'";
  if (sampler_interpolation.empty() || sampler_interpolation == "LINEAR")
    interpolation = Interpolation::kLinear;
  else if (sampler_interpolation == "STEP")
    interpolation = Interpolation::kStep;
  else if (sampler_interpolation == "CUBICSPLINE")
    interpolation = Interpolation::kCubic;
  else
    return "unknown interpolation '" + sampler_interpolation + "'";
  return {};
}

std::string Animation::Channel::fault_of_keys() const {
  const auto all_finite = [](const std::vector<double>& numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
  };
  if (times.empty()) return "it has no keys";
  if (!all_finite(times) || !all_finite(values)) return "a number is not finite";
  for (std::size_t i = 1; i < times.size(); ++i)
    if (!(times[i - 1] < times[i])) return "key " + std::to_string(i) + " is not after the one before";
  const std::size_t wanted = times.size() * (interpolation == Interpolation::kCubic ? 3 : 1);
  if (values.size() != wanted * components())
    return std::to_string(values.size() / components()) + " values, " + std::to_string(wanted) + " expected";
  return {};
}

build::Result<void> Animation::read_channel(const tinygltf::Model& model, std::size_t animation, std::size_t index,
                                            std::vector<Channel>& channels) {
  const tinygltf::Animation& from = model.animations[animation];
  const tinygltf::AnimationChannel& channel = from.channels[index];
  const std::string location = "animation " + std::to_string(animation) + ", channel " + std::to_string(index) + ": ";
  const auto fault = [&](const std::string& what) { return invalid_input(location + what); };
  // Without a node there is nothing to move (glTF 2.0, 3.11).
  if (channel.target_node < 0) return {};
  const auto node = static_cast<std::size_t>(channel.target_node);
  if (node >= model.nodes.size()) return fault("node " + std::to_string(node) + " does not exist");
  if (channel.target_path != "weights" && !model.nodes[node].matrix.empty())
    return fault("node " + std::to_string(node) + " has a matrix");
  if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= from.samplers.size())
    return fault("sampler " + std::to_string(channel.sampler) + " does not exist");
  const tinygltf::AnimationSampler& sampler = from.samplers[static_cast<std::size_t>(channel.sampler)];
  Channel result{node, Path::kTranslation, Interpolation::kLinear, {}, {}, location};
  if (const std::string wrong = result.set_kind(channel.target_path, sampler.interpolation); !wrong.empty())
    return fault(wrong);
  auto times = read_vectors(model, sampler.input, 1);
  if (!times) return fault("input: " + times.error().message);
  if (result.path == Path::kWeight) {
    result.times = std::move(*times);
    return read_weights(model, sampler, result, channels);
  }
  auto values = read_vectors(model, sampler.output, static_cast<unsigned>(result.components()));
  if (!values) return fault("output: " + values.error().message);
  result.times = std::move(*times);
  result.values = std::move(*values);
  if (const std::string wrong = result.fault_of_keys(); !wrong.empty()) return fault(wrong);
  channels.push_back(std::move(result));
  return {};
}

build::Result<void> Animation::read_weights(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                                            const Channel& like, std::vector<Channel>& channels) {
  const auto values = read_vectors(model, sampler.output, 1);
  if (!values) return invalid_input(like.location + "output: " + values.error().message);
  const std::size_t parts = like.interpolation == Interpolation::kCubic ? 3 : 1, rows = parts * like.times.size();
  if (rows == 0 || values->empty() || values->size() % rows != 0)
    return invalid_input(like.location + std::to_string(values->size()) + " weights, a multiple of " +
                         std::to_string(rows) + " expected");
  const std::size_t targets = values->size() / rows;
  for (std::size_t target = 0; target < targets; ++target) {
    Channel channel = like;
    channel.target = target;
    for (std::size_t row = 0; row < rows; ++row) channel.values.push_back((*values)[row * targets + target]);
    if (const std::string wrong = channel.fault_of_keys(); !wrong.empty()) return invalid_input(like.location + wrong);
    channels.push_back(std::move(channel));
  }
  return {};
}

double Animation::Channel::turned(double from, double to) const {
  if (path != Path::kRotation || interpolation == Interpolation::kStep) return 0;
  std::vector<double> stops{from};
  for (const double time : times)
    if (time > from && time < to) stops.push_back(time);
  // Of a spline the turn between two keys is that of its parts.
  if (interpolation == Interpolation::kCubic) {
    constexpr unsigned kParts = 8;
    const std::vector<double> keys = stops;
    for (std::size_t i = 0; i < keys.size(); ++i)
      for (unsigned k = 1; k < kParts; ++k)
        stops.push_back(keys[i] + k * ((i + 1 < keys.size() ? keys[i + 1] : to) - keys[i]) / kParts);
    std::sort(stops.begin(), stops.end());
  }
  stops.push_back(to);
  double sum = 0;
  for (std::size_t i = 1; i < stops.size(); ++i)
    sum += 2 * std::acos(std::min(1.0, std::fabs(dot(at(stops[i - 1]), at(stops[i])))));
  return sum;
}

std::optional<std::size_t> Animation::Channel::whole_turn() const {
  constexpr double kNearly = 1e-6;
  if (path != Path::kRotation || interpolation != Interpolation::kLinear) return std::nullopt;
  for (std::size_t i = 1; i < times.size(); ++i)
    if (dot(unit(key(i - 1, 0)), unit(key(i, 0))) < -1 + kNearly) return i - 1;
  return std::nullopt;
}

void Animation::warn_of_turns(const std::vector<float>& times, std::vector<std::string>& warnings) const {
  constexpr double kHalfTurn = std::numbers::pi + 1e-3;
  for (const Channel& channel : channels_) {
    if (const auto first = channel.whole_turn())
      warnings.push_back(channel.location + "keys " + std::to_string(*first) + " and " + std::to_string(*first + 1) +
                         " are one orientation: a turn of 360 degrees between two keys stands still");
    for (std::size_t i = 1; i < times.size(); ++i) {
      const double angle = channel.turned(static_cast<double>(times[i - 1]), static_cast<double>(times[i]));
      if (!(angle > kHalfTurn)) continue;
      warnings.push_back(channel.location + "node " + std::to_string(channel.node) + " turns by " +
                         std::to_string(std::lround(angle * 180 / std::numbers::pi)) +
                         " degrees between two --motion-keys, which take the shorter arc: use more of them");
      break;
    }
  }
}

build::Result<Animation> Animation::read(const tinygltf::Model& model) {
  Animation result;
  for (std::size_t a = 0; a < model.animations.size(); ++a)
    for (std::size_t c = 0; c < model.animations[a].channels.size(); ++c)
      if (auto done = read_channel(model, a, c, result.channels_); !done) return tl::unexpected(done.error());
  return result;
}

void Animation::pose(double seconds, tinygltf::Model& model) const {
  for (const Channel& channel : channels_) {
    tinygltf::Node& node = model.nodes[channel.node];
    const Value value = channel.at(seconds);
    if (channel.path == Path::kWeight) {
      if (node.weights.empty() && node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < model.meshes.size())
        node.weights = model.meshes[static_cast<std::size_t>(node.mesh)].weights;
      node.weights.resize(std::max(node.weights.size(), channel.target + 1));
      node.weights[channel.target] = value[0];
      continue;
    }
    std::vector<double>& to = channel.path == Path::kTranslation ? node.translation
                              : channel.path == Path::kRotation  ? node.rotation
                                                                 : node.scale;
    to.assign(value.begin(), value.begin() + static_cast<std::ptrdiff_t>(channel.components()));
  }
}

}  // namespace hiprt::tools
