#pragma once
/// Embree's builders for tests: SBVH instead where the library was built without Embree.

#include <hiprt_build/build.h>

namespace hiprt::oracle {

inline constexpr bool kHasEmbree = HIPRT_EMBREE_MAJOR != 0;
inline constexpr build::Builder kEmbreeLow = kHasEmbree ? build::Builder::kEmbreeLow : build::Builder::kSbvh;
inline constexpr build::Builder kEmbreeMedium = kHasEmbree ? build::Builder::kEmbreeMedium : build::Builder::kSbvh;
inline constexpr build::Builder kEmbreeHigh = kHasEmbree ? build::Builder::kEmbreeHigh : build::Builder::kSbvh;

}  // namespace hiprt::oracle
