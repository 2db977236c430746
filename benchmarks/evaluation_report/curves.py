"""Time to an image: build, then trace sample after sample."""

import math

from .runs import quartiles

# Builders that take long and make better trees, and fast builders.
SLOW = ["sah", "sbvh", "hq", "embree-high"]
FAST = ["lbvh", "ploc", "hploc"]
MOST_SAMPLES = 1 << 20


def samples_until(extra_build, saved):
    """After how many samples the slower build has the image first, if each sample saves so many seconds."""
    if extra_build <= 0:
        return 0.0 if saved >= 0 else math.nan
    return extra_build / saved if saved > 0 else math.inf


def crossover(slow, fast):
    """@return (samples, least, most) after which the slow builder has the image first. least and most come from the
    quartiles, over the rounds, of the time that a sample saves. 0: from the start; infinite: never; nan: the slow
    builder is ahead at first only."""
    extra = slow.build_seconds - fast.build_seconds
    saved = [b - a for a, b in zip(slow.round_seconds(), fast.round_seconds())]
    low, high = quartiles(saved)
    return (samples_until(extra, fast.sample_seconds() - slow.sample_seconds()), samples_until(extra, high),
            samples_until(extra, low))


def crossovers(scene, hierarchy):
    """@return (slow entry, fast entry, crossover) of all pairs that were measured. All builders count as slow beside
    Vulkan."""
    slow = {name: scene.entry(hierarchy, name) for name in SLOW + FAST}
    pairs = [(slow[name], slow[fast]) for name in SLOW for fast in FAST]
    pairs += [(entry, vulkan) for entry in slow.values() for vulkan in scene.vulkan(hierarchy)]
    return [(slow, fast, crossover(slow, fast)) for slow, fast in pairs if slow and fast]


def sample_counts(scene, hierarchy):
    """@return powers of two from 1 to beyond all crossovers of the hierarchy, at least to 1024."""
    finite = [samples for _, _, (samples, _, _) in crossovers(scene, hierarchy)
              if math.isfinite(samples) and samples > 0]
    most = min(MOST_SAMPLES, max([1024, *(8 * samples for samples in finite)]))
    return [2**i for i in range(math.ceil(math.log2(most)) + 1)]
