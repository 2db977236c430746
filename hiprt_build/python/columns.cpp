#include <hiprt_build/python/columns.h>

namespace hiprt::python {

void check(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size, bool fits_type) {
  if (!fits_type || array.ndim() != dimensions || array.shape(0) != size || (dimensions == 2 && array.shape(1) != 3))
    refuse(std::string(name) + ": the array has another type or shape than " + std::to_string(size) +
           (dimensions == 2 ? " x 3" : "") + " numbers");
}

void check_real(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size) {
  check(name, array, dimensions, size, holds<float>(array) || holds<double>(array));
}

Column::Column(const InputArray& array, std::size_t component) {
  const auto size = static_cast<std::ptrdiff_t>(array.itemsize());
  is_double = holds<double>(array);
  if (array.size() == 0) return;
  stride = array.stride(0) * size;
  first = static_cast<const std::byte*>(array.data());
  if (array.ndim() > 1) first += static_cast<std::ptrdiff_t>(component) * array.stride(1) * size;
}

}  // namespace hiprt::python
