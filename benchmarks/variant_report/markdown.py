"""Tables and numbers in Markdown."""

import math


def table(head, rows):
    # Names may hold what separates columns.
    rows = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    lines = ["| " + " | ".join(head) + " |", "|" + "|".join(["---"] + ["---:"] * (len(head) - 1)) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def number(value, digits=2):
    return "" if value is None or math.isnan(value) else f"{value:.{digits}f}"


def per_query(numbers):
    """Closest hits first."""
    return "/".join(str(numbers[query]) for query in sorted(numbers, reverse=True))
