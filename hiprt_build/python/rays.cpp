#include <hiprt_build/python/rays.h>

namespace hiprt::python {

namespace nb = nanobind;

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
  each_mask(mask_, first, count, [&](std::size_t i, std::uint32_t x) { to[i].mask = x; });
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
