#include <tools/parts/part_owners.h>

#include <algorithm>
#include <cstdint>

namespace hiprt::tools {
namespace {

/// Fills processes up to a limit, in turn. @return the process of each part; too many processes if the limit is low.
std::vector<unsigned> fill(std::span<const ScenePart> parts, std::uint64_t limit) {
  std::vector<unsigned> owner;
  unsigned process = 0;
  std::uint64_t bytes = 0;
  for (const ScenePart& part : parts) {
    if (bytes != 0 && bytes + part.bytes() > limit) {
      ++process;
      bytes = 0;
    }
    bytes += part.bytes();
    owner.push_back(process);
  }
  return owner;
}

}  // namespace

std::vector<unsigned> owners_of(std::span<const ScenePart> parts, unsigned processes) {
  std::vector<unsigned> owner;
  if (parts.size() <= processes) {
    for (std::size_t i = 0; i < parts.size(); ++i) owner.push_back(static_cast<unsigned>(i * processes / parts.size()));
    return owner;
  }
  std::uint64_t low = 0, high = 0;  // The least limit that is enough is in (low, high].
  for (const ScenePart& part : parts) {
    low = std::max(low, part.bytes());
    high += part.bytes();
  }
  low = low == 0 ? 0 : low - 1;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (fill(parts, middle).back() < processes ? high : low) = middle;
  }
  return fill(parts, high);
}

}  // namespace hiprt::tools
