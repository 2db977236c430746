#pragma once
/// Searches for inputs that come closest to a bound: random starts, then large and small changes of a few numbers. A
/// change is kept if it comes at least as close.

#include <tests/oracle/random.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace hiprt::oracle {

using Genes = std::vector<float>;

struct Worst {
  double random = 0.0;  ///< The largest score of the random starts,
  double score = 0.0;   ///< and of the search.
  Genes genes;          ///< That have it.
};

/// Changes one number: by units in the last place, by a power of two, its sign, or to (nearly) another of the numbers.
inline void mutate(Genes& genes, Random& random) {
  const auto count = static_cast<std::uint32_t>(genes.size());
  float& gene = genes[random.below(count)];
  switch (random.below(6)) {
    case 0:
    case 1: {
      const float toward = random.coin() ? std::numeric_limits<float>::max() : -std::numeric_limits<float>::max();
      for (std::uint32_t steps = 1 + random.below(random.coin() ? 3 : 1000); steps > 0; --steps)
        gene = std::nextafter(gene, toward);
      break;
    }
    case 2:
      gene = std::ldexp(gene, random.coin() ? 1 : -1);
      break;
    case 3:
      gene *= static_cast<float>(random.uniform(0.9, 1.1));
      break;
    case 4:
      gene = genes[random.below(count)];
      break;
    default:
      gene = -gene;
  }
}

/// Changes one number by 1, 2, 4, ... 2^13 units in its last place: for starts that are nearly a proof's worst case.
inline void nudge(Genes& genes, Random& random) {
  float& gene = genes[random.below(static_cast<std::uint32_t>(genes.size()))];
  const float size = std::abs(gene), unit = std::nextafter(size, std::numeric_limits<float>::max()) - size;
  gene += (random.coin() ? 1.0f : -1.0f) * std::ldexp(unit, static_cast<int>(random.below(14)));
}

/// @param make Genes(random): a start. @param score of genes: what may be at most 1 if the bound holds; below 0: they
/// say nothing, or are out of range. @param starts, steps scored, each start with so many steps.
/// @param change mutate() or nudge().
template <class Make, class Score>
Worst climb(std::uint64_t seed, unsigned starts, unsigned steps, const Make& make, const Score& score,
            void (*change)(Genes&, Random&) = mutate) {
  Random random(seed);
  Worst worst;
  for (unsigned start = 0; start < starts; ++start) {
    Genes genes = make(random);
    double here = score(genes);
    worst.random = std::max(worst.random, here);
    for (unsigned step = 0; step < steps; ++step) {
      Genes next = genes;
      for (std::uint32_t changes = 1 + random.below(3); changes > 0; --changes) change(next, random);
      const double there = score(next);
      if (there < here) continue;
      genes = std::move(next);
      here = there;
    }
    if (here > worst.score) worst.score = here, worst.genes = genes;
  }
  return worst;
}

}  // namespace hiprt::oracle
