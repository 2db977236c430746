#include <hiprt_build/python/points.h>

namespace hiprt::python {

namespace nb = nanobind;

Points::Points(const InputArray& points, const InputArray& max_distance, const InputArray& mask, const InputArray& time)
    : arrays_{points, max_distance, mask, time},
      point_{Column(points, 0), Column(points, 1), Column(points, 2)},
      max_distance_(max_distance),
      mask_(mask),
      time_(time),
      size_(points.ndim() == 0 ? 0 : points.shape(0)) {
  check_real("points", points, 2, size_);
  check_real("max_distance", max_distance, 1, size_);
  check("mask", mask, 1, size_, holds<std::uint32_t>(mask));
  check("time", time, 1, size_, holds<float>(time));
}

template <class Real> void Points::gather(std::size_t first, std::size_t count, PointQueryD* to) const {
  for (unsigned axis = 0; axis < 3; ++axis)
    each<Real>(point_[axis], first, count,
               [&](std::size_t i, Real x) { to[i].point[static_cast<int>(axis)] = static_cast<double>(x); });
  each<Real>(max_distance_, first, count, [&](std::size_t i, Real x) { to[i].max_distance = static_cast<double>(x); });
  each<float>(time_, first, count, [&](std::size_t i, float x) { to[i].time = x; });
  each_mask(mask_, first, count, [&](std::size_t i, std::uint32_t x) { to[i].mask = x; });
}

template void Points::gather<float>(std::size_t, std::size_t, PointQueryD*) const;
template void Points::gather<double>(std::size_t, std::size_t, PointQueryD*) const;

void add_points(nb::module_& module) {
  nb::class_<Points>(module, "Points", "Views of the arrays of a batch of points.")
      .def(nb::init<const InputArray&, const InputArray&, const InputArray&, const InputArray&>(), nb::arg("points"),
           nb::arg("max_distance"), nb::arg("mask"), nb::arg("time"),
           "points: n x 3, max_distance: n, float32 or float64. mask: n, uint32. time: n, float32.")
      .def("__len__", &Points::size, "Number of points.");
}

}  // namespace hiprt::python
