"""Formats numbers."""

import math


def significant(value, digits=3):
    """With this number of significant digits, without an exponent."""
    if value is None or math.isnan(value):
        return ""
    if value == 0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):,.{max(0, places)}f}".replace(",", "\u202f")


def seconds(value):
    """With a suitable unit."""
    for unit, name in [(1, "s"), (1e-3, "ms"), (1e-6, "µs")]:
        if value >= unit or unit == 1e-6:
            return f"{significant(value / unit)} {name}"
    return ""


def count(value):
    """1234567 as 1.23 M."""
    for unit, name in [(1e9, " G"), (1e6, " M"), (1e3, " k")]:
        if value >= 1000 * (unit / 1e3) and value >= unit:
            return significant(value / unit) + name
    return significant(value, 3) if value != int(value) else str(int(value))


def megabytes(value):
    return significant(value * 1e-6)


def samples(value):
    """Formats a crossover."""
    if math.isnan(value):
        return "at first only"
    if math.isinf(value):
        return "never"
    if value == 0:
        return "from the start"
    return count(math.ceil(value))
