#include "sample_blocks.h"

#include <algorithm>
#include <random>

namespace hiprt::bench {

std::vector<std::uint32_t> sample_blocks(std::uint32_t count, std::uint32_t wanted) {
  constexpr std::uint32_t kBlock = 64;
  const std::uint32_t blocks = (count + kBlock - 1) / kBlock;
  const std::uint32_t step = wanted >= count ? 1 : std::max(1u, (count + wanted / 2) / std::max(1u, wanted));
  std::vector<std::uint32_t> chosen;
  std::mt19937 random;
  for (std::uint32_t group = 0; group < blocks; group += step) {
    const std::uint32_t block = group + static_cast<std::uint32_t>(random()) % std::min(step, blocks - group);
    for (std::uint32_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) chosen.push_back(i);
  }
  return chosen;
}

}  // namespace hiprt::bench
