#pragma once
/// Shared by all checks of guarantees.cpp: digests of the inputs and of the hits, and a tally. The tally prints each
/// fault with its trial and seed.

#include <hiprt_device/hiprt_device.h>

#include <bit>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

namespace hiprt::flags {

/// FNV-1a.
class Digest {
 public:
  void add(std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) state_ = (state_ ^ (bits >> shift & 255u)) * 0x100000001b3u;
  }
  void add(float x) { add(std::bit_cast<std::uint32_t>(x)); }
  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    add(static_cast<std::uint32_t>(bits));
    add(static_cast<std::uint32_t>(bits >> 32));
  }
  template <class Real> void add(const BasicVec3<Real>& v) {
    for (const Real x : {v.x, v.y, v.z}) add(x);
  }
  template <class Real> void add(const BasicRay<Real>& ray) {
    add(ray.origin);
    add(ray.direction);
    for (const Real x : {ray.tmin, ray.tmax}) add(x);
    add(ray.time);
  }
  template <class Real> void add(const BasicHit<Real>& hit) {
    for (const Real x : {hit.t, hit.u, hit.v}) add(x);
    add(hit.normal);
    add(hit.error);
    add(hit.geometry);
    add(hit.primitive);
  }
  template <class Real, unsigned kLevels> void add(const BasicPathHit<Real, kLevels>& hit) {
    add(static_cast<const BasicHit<Real>&>(hit));
    if constexpr (kLevels != 0)
      for (std::uint32_t i = 0; i < hit.path.depth; ++i) add(hit.path.instance[i]);
  }
  void add(const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      add(box.min[axis]);
      add(box.max[axis]);
    }
  }
  unsigned long long value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

/// A series of checks. finish() prints a line that must be the same under all compiler settings. If the digest of the
/// inputs differs already, the fault is not in a query.
class Check {
 public:
  Check(std::string name, std::uint64_t seed) : name_(std::move(name)), seed_(seed) {}

  /// Begins a trial, in messages "ray i" from 0 on.
  template <class Real> void on_ray(const BasicRay<Real>& ray) {
    ++rays_;
    ray_ = convert<double>(ray);
    at_ray_ = true;
    inputs_.add(ray);
  }
  /// The same of what holds without rays, at a time.
  void on_time(float time) {
    ray_.time = time;
    at_ray_ = false;
    at_time_ = true;
    inputs_.add(time);
  }
  template <class HitType> void on_hit(const HitType& hit) {
    hits_ += hit.found() ? 1 : 0;
    outputs_.add(hit);
  }
  /// Another input, or an output that must have the same bits.
  template <class Value> void put_in(const Value& value) { inputs_.add(value); }
  template <class Value> void put_out(const Value& value) { outputs_.add(value); }

  /// Counts a fault unless @p holds, and describes the first few.
  [[gnu::format(printf, 3, 4)]] bool expect(bool holds, const char* format, ...) {
    if (holds) return true;
    if (++faults_ > kTold) return false;
    std::fprintf(stderr, "%s, seed %llu", name_.c_str(), static_cast<unsigned long long>(seed_));
    if (at_ray_)
      std::fprintf(stderr, ", ray %u from (%a %a %a) along (%a %a %a), [%a, %a], time %a", rays_ - 1, ray_.origin.x,
                   ray_.origin.y, ray_.origin.z, ray_.direction.x, ray_.direction.y, ray_.direction.z, ray_.tmin,
                   ray_.tmax, static_cast<double>(ray_.time));
    else if (at_time_)
      std::fprintf(stderr, ", time %a", static_cast<double>(ray_.time));
    std::fputs(": ", stderr);
    std::va_list arguments;
    va_start(arguments, format);
    std::vfprintf(stderr, format, arguments);
    va_end(arguments);
    std::fputc('\n', stderr);
    return false;
  }

  /// @param least hits: with fewer little was checked, which is a fault too. 0: of checks without rays. @return faults.
  unsigned finish(unsigned least = 0) {
    expect(hits_ >= least, "%u hits only, at least %u expected", hits_, least);
    std::printf("%s: in %016llx, out %016llx", name_.c_str(), inputs_.value(), outputs_.value());
    if (rays_ != 0) std::printf(", %u of %u rays hit", hits_, rays_);
    std::printf("\n");
    if (faults_ != 0) std::fprintf(stderr, "%s: %u faults\n", name_.c_str(), faults_);
    return faults_;
  }

 private:
  static constexpr unsigned kTold = 3;

  std::string name_;
  std::uint64_t seed_;
  RayD ray_{};
  bool at_ray_ = false, at_time_ = false;
  Digest inputs_, outputs_;
  unsigned rays_ = 0, hits_ = 0, faults_ = 0;
};

}  // namespace hiprt::flags
