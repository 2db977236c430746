#include <hiprt_build/python/options.h>

#include <hiprt_build/python/errors.h>

#include <nanobind/stl/string.h>

#include <string>
#include <utility>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

constexpr std::pair<const char*, build::Quality> kQualities[] = {
    {"fast", build::Quality::kFast}, {"balanced", build::Quality::kBalanced}, {"high", build::Quality::kHigh}};
constexpr std::pair<const char*, NodeLayout> kLayouts[] = {{"planes", NodeLayout::kPlanes},
                                                           {"float", NodeLayout::kFloat},
                                                           {"half", NodeLayout::kHalf},
                                                           {"quantized", NodeLayout::kQuantized}};

template <class T, std::size_t N>
T value_of_word(const char* what, const std::string& word, const std::pair<const char*, T> (&words)[N]) {
  std::string known;
  for (const auto& [name, value] : words) {
    if (word == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  refuse(std::string(what) + ": '" + word + "' is none of " + known);
}

build::Builder builder_of(const std::string& word) {
  std::string known;
  for (auto builder = build::Builder::kSah; builder != build::Builder::kImported;
       builder = static_cast<build::Builder>(static_cast<int>(builder) + 1)) {
    if (word == build::name(builder)) return builder;
    known += (known.empty() ? "" : ", ") + std::string(build::name(builder));
  }
  refuse("builder: '" + word + "' is none of " + known);
}

/// Calls take(value) if the key has one.
template <class T, class Take> void with(const nb::dict& options, const char* key, const Take& take) {
  if (!options.contains(key) || options[key].is_none()) return;
  T value;
  if (!nb::try_cast<T>(options[key], value))
    refuse(std::string(key) + ": " + nb::cast<std::string>(nb::repr(options[key])) +
           " has the wrong type or is out of range");
  take(std::move(value));
}

}  // namespace

build::BuildOptions options_from(const nb::dict& options, const build::BuildOptions& defaults) {
  build::BuildOptions result = defaults;
  with<std::string>(options, "quality", [&](const std::string& word) {
    result = build::options_for(value_of_word("quality", word, kQualities));
  });
  with<std::string>(options, "builder", [&](const std::string& word) { result.builder = builder_of(word); });
  with<std::string>(options, "layout",
                    [&](const std::string& word) { result.nodes = value_of_word("layout", word, kLayouts); });
  with<unsigned>(options, "threads", [&](unsigned threads) { result.threads = threads; });
  with<double>(options, "split_budget", [&](double budget) { result.split_budget = budget; });
  with<double>(options, "presplit_budget", [&](double budget) { result.presplit_budget = budget; });
  with<unsigned>(options, "reinsertion_rounds", [&](unsigned rounds) { result.reinsertion_rounds = rounds; });
  with<unsigned>(options, "max_leaf_triangles", [&](unsigned most) { result.max_leaf_triangles = most; });
  with<unsigned>(options, "ploc_radius", [&](unsigned radius) { result.ploc_radius = radius; });
  with<bool>(options, "pair_triangles", [&](bool pairs) { result.pair_triangles = pairs; });
  return result;
}

}  // namespace hiprt::python
