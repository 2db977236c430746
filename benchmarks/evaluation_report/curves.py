"""Time to an image: build, then trace sample after sample."""

import math

from .runs import quartiles

# Slow to build against fast to build.
SLOW = ["sah", "sbvh", "hq"]
FAST = ["lbvh", "ploc", "hploc"]
MOST_SAMPLES = 1 << 20


def samples_until(extra_build, saved):
    """The number of samples after which the slower build has the image first, if each sample saves these seconds."""
    if extra_build <= 0:
        return 0.0 if saved >= 0 else math.nan
    return extra_build / saved if saved > 0 else math.inf


def crossover(slow, fast):
    """(samples, least, most): least and most by the quartiles of what a sample saves, round by round. 0: from the start;
    infinite: never; nan: it is faster at first only."""
    extra = slow.build_seconds - fast.build_seconds
    saved = [b - a for a, b in zip(slow.round_seconds(), fast.round_seconds())]
    low, high = quartiles(saved)
    return (samples_until(extra, fast.sample_seconds() - slow.sample_seconds()), samples_until(extra, high),
            samples_until(extra, low))


def crossovers(scene, hierarchy):
    """(slow entry, fast entry, crossover) of all pairs that were measured."""
    pairs = [(scene.entry(hierarchy, slow), scene.entry(hierarchy, fast)) for slow in SLOW for fast in FAST]
    return [(slow, fast, crossover(slow, fast)) for slow, fast in pairs if slow and fast]


def sample_counts(scene, hierarchy):
    """Powers of two for the curves' ends: up to where all crossovers of the hierarchy lie, and at least 1024."""
    finite = [samples for _, _, (samples, _, _) in crossovers(scene, hierarchy) if math.isfinite(samples) and samples > 0]
    most = min(MOST_SAMPLES, max([1024, *(8 * samples for samples in finite)]))
    return [2**i for i in range(math.ceil(math.log2(most)) + 1)]
