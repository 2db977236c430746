#include <hiprt_build/python/rays.h>

#include <hiprt_build/python/errors.h>
#include <hiprt_device/math/arithmetic.h>

#include <cstring>
#include <string>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

template <class T> bool holds(const InputArray& array) { return array.dtype() == nb::dtype<T>(); }

void check(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size, bool fits_type) {
  if (!fits_type || array.ndim() != dimensions || array.shape(0) != size || (dimensions == 2 && array.shape(1) != 3))
    refuse(std::string(name) + ": the array has another type or shape than " + std::to_string(size) +
           (dimensions == 2 ? " x 3" : "") + " numbers");
}

void check_real(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size) {
  check(name, array, dimensions, size, holds<float>(array) || holds<double>(array));
}

template <class T> T read(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

template <class Real> Real rounded(float x) { return x; }
template <class Real> Real rounded(double x) {
  if constexpr (sizeof(Real) == sizeof(double))
    return x;
  else
    return nearest_float(x);
}

/// @param put takes the number of a ray and its value.
template <class Real, class Put> void each(const Column& column, std::size_t first, std::size_t count, const Put& put) {
  const std::byte* from = column.first + static_cast<std::ptrdiff_t>(first) * column.stride;
  if (column.is_double)
    for (std::size_t i = 0; i < count; ++i, from += column.stride) put(i, rounded<Real>(read<double>(from)));
  else
    for (std::size_t i = 0; i < count; ++i, from += column.stride) put(i, rounded<Real>(read<float>(from)));
}

}  // namespace

Column::Column(const InputArray& array, std::size_t component) {
  const auto size = static_cast<std::ptrdiff_t>(array.itemsize());
  is_double = holds<double>(array);
  if (array.size() == 0) return;
  stride = array.stride(0) * size;
  first = static_cast<const std::byte*>(array.data());
  if (array.ndim() > 1) first += static_cast<std::ptrdiff_t>(component) * array.stride(1) * size;
}

Rays::Rays(const InputArray& origins, const InputArray& directions, const InputArray& tmin, const InputArray& tmax,
           const InputArray& mask, const InputArray& time)
    : arrays_{origins, directions, tmin, tmax, mask, time},
      origin_{Column(origins, 0), Column(origins, 1), Column(origins, 2)},
      direction_{Column(directions, 0), Column(directions, 1), Column(directions, 2)},
      tmin_(tmin),
      tmax_(tmax),
      mask_(mask),
      time_(time),
      size_(origins.ndim() == 0 ? 0 : origins.shape(0)) {
  check_real("origins", origins, 2, size_);
  check_real("directions", directions, 2, size_);
  check_real("tmin", tmin, 1, size_);
  check_real("tmax", tmax, 1, size_);
  check("mask", mask, 1, size_, holds<std::uint32_t>(mask));
  check("time", time, 1, size_, holds<float>(time));
}

template <class Real> void Rays::gather(std::size_t first, std::size_t count, BasicRay<Real>* to) const {
  for (unsigned axis = 0; axis < 3; ++axis) {
    each<Real>(origin_[axis], first, count, [&](std::size_t i, Real x) { to[i].origin[static_cast<int>(axis)] = x; });
    each<Real>(direction_[axis], first, count,
               [&](std::size_t i, Real x) { to[i].direction[static_cast<int>(axis)] = x; });
  }
  each<Real>(tmin_, first, count, [&](std::size_t i, Real x) { to[i].tmin = x; });
  each<Real>(tmax_, first, count, [&](std::size_t i, Real x) { to[i].tmax = x; });
  each<float>(time_, first, count, [&](std::size_t i, float x) { to[i].time = x; });
  const std::byte* mask = mask_.first + static_cast<std::ptrdiff_t>(first) * mask_.stride;
  for (std::size_t i = 0; i < count; ++i, mask += mask_.stride) to[i].mask = read<std::uint32_t>(mask);
}

template void Rays::gather(std::size_t, std::size_t, Ray*) const;
template void Rays::gather(std::size_t, std::size_t, RayD*) const;

void add_rays(nb::module_& module) {
  nb::class_<Rays>(module, "Rays", "Views of the arrays of a batch of rays.")
      .def(nb::init<const InputArray&, const InputArray&, const InputArray&, const InputArray&, const InputArray&,
                    const InputArray&>(),
           nb::arg("origins"), nb::arg("directions"), nb::arg("tmin"), nb::arg("tmax"), nb::arg("mask"),
           nb::arg("time"),
           "origins, directions: n x 3; tmin, tmax: n, float32 or float64. mask: n, uint32. time: n, float32.")
      .def("__len__", &Rays::size, "Number of rays.");
}

}  // namespace hiprt::python
