#pragma once
/// Searches that start at a proof's own worst case. Operands are just above a power of two, where roundings are
/// largest. The triangle is small beside its distance, so the part of a bound for its size is not used.

#include <tests/traversal/worst_cases.h>

namespace hiprt::checks {

/// A number a few units in the last place above @p x.
inline float just_above(Random& random, float x) {
  for (std::uint32_t steps = random.below(6); steps > 0; --steps) x = std::nextafter(x, 2 * x);
  return x;
}

/// The genes of case_of(): a triangle near the coordinates' origin, and a ray from about (1, 1, 1).
/// @param least, most size of the triangle in units of 2^-23, the spacing of floats at its distance.
/// @param beside the origin's x and y instead of 1: shears of about so much.
inline Genes far_genes(Random& random, double least, double most, float beside = 1.0f) {
  Genes genes;
  const double size = 0x1p-23 * random.log_uniform(least, most);
  for (unsigned i = 0; i < 9; ++i) genes.push_back(static_cast<float>(size * random.uniform(-1, 1)));
  for (const float x : {beside, beside, 1.0f}) genes.push_back((random.coin() ? 1.0f : -1.0f) * just_above(random, x));
  genes.push_back(random.uniform_float(0, 1));
  genes.push_back(random.uniform_float(0, 1) * (1 - genes.back()));
  return genes;
}
inline Genes small_genes(Random& random) { return far_genes(random, 20, 500); }

/// The same of a triangle in a plane x = constant, whose box has no width that could hide an error.
template <class Score> auto flat(const Score& score) {
  return [=](Genes genes) {
    genes[3] = genes[6] = genes[0];
    return score(genes);
  };
}

/// @param floor a part of the bound that three seeds have reached, with some to spare.
/// @param guide what the search climbs: @p share, or nearly the same in less time.
/// @param share exact, of what was found.
template <class Make, class Guide, class Share>
void search_directed(const char* what, unsigned starts, unsigned steps, double floor, const Make& make,
                     const Guide& guide, const Share& share) {
  for (const std::uint64_t seed : {kWorstSeed, kWorstSeed + 1, kWorstSeed + 2}) {
    const Worst worst = climb(seed, starts, steps, make, guide, nudge);
    const double reached = share(worst.genes);
    std::printf("%-34s used up: %.3f of the starts, %.3f directed, seed %llu\n", what, worst.random, reached,
                static_cast<unsigned long long>(seed));
    INFO(what << ", seed " << seed);
    CHECK(reached <= 1.0);
    CHECK(reached >= floor);
  }
}
template <class Make, class Share>
void search_directed(const char* what, unsigned starts, unsigned steps, double floor, const Make& make,
                     const Share& share) {
  search_directed(what, starts, steps, floor, make, share, share);
}

}  // namespace hiprt::checks
