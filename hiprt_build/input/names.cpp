#include <hiprt_build/build.h>

namespace hiprt::build {

const char* name(Builder builder) {
  switch (builder) {
    case Builder::kSah:
      return "sah";
    case Builder::kLbvh:
      return "lbvh";
    case Builder::kLbvh30:
      return "lbvh30";
    case Builder::kPloc:
      return "ploc";
    case Builder::kHploc:
      return "hploc";
    case Builder::kSbvh:
      return "sbvh";
    case Builder::kHq:
      return "hq";
    case Builder::kEmbreeLow:
      return "embree-low";
    case Builder::kEmbreeMedium:
      return "embree-medium";
    case Builder::kEmbreeHigh:
      return "embree-high";
    case Builder::kImported:
      return "imported";
  }
  return "unknown";
}

const char* name(Quality quality) {
  switch (quality) {
    case Quality::kFast:
      return "fast";
    case Quality::kBalanced:
      return "balanced";
    case Quality::kHigh:
      return "high";
  }
  return "unknown";
}

}  // namespace hiprt::build
