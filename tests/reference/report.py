"""Parts of a report in Markdown: tables, numbers, intervals, and whether a goal is met, in words."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

STUDENT = {2: 12.706, 20: 2.093}
"""Two-sided 95 % points of Student's t by the count of numbers, one more than the degrees of freedom."""


@dataclass(frozen=True)
class Interval:
    """A mean and its 95 % interval."""

    mean: float
    low: float
    high: float


def interval_of(values: Sequence[float]) -> Interval:
    """Returns the mean of independent numbers, with Student's 95 % interval of the mean."""
    mean = statistics.fmean(values)
    half = STUDENT[len(values)] * statistics.stdev(values) / math.sqrt(len(values))
    return Interval(mean, mean - half, mean + half)


def fixed(value: float, digits: int, sign: bool = False) -> str:
    """Formats a number with this many decimals, a true minus, and a plus if requested. Zero has no sign."""
    text = f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"
    if float(text) == 0:
        text = f"{0:.{digits}f}"
    return text.replace("-", "−")


def percent(share: float, digits: int = 1, sign: bool = False) -> str:
    """Formats a fraction as a percentage."""
    return fixed(100 * share, digits, sign) + " %"


def interval_words(interval: Interval, digits: int) -> str:
    """Formats an interval as `low…high`."""
    return f"{fixed(interval.low, digits)}…{fixed(interval.high, digits)}"


def relative_error(found: float, wanted: float) -> float:
    """Returns the relative error, positive if the size is larger than expected."""
    return (found - wanted) / wanted


def within(found: float, wanted: float, limit: float) -> str:
    """Returns `met`, or by how much a number misses one that it should be within a fraction of."""
    error = relative_error(found, wanted)
    if abs(error) <= limit:
        return "met"
    return f"**missed**: off by {percent(error, 2, sign=True)}, goal {percent(limit, 0)}"


def at_least(found: float, least: float, digits: int) -> str:
    """Returns `met`, or the number that was found instead of at least this."""
    if found >= least:
        return "met"
    return f"**missed**: {fixed(found, digits + 1)}, goal {fixed(least, digits)}"


def all_of(count: int, total: int) -> str:
    """Returns `met`, or how many are missing."""
    return "met" if count == total else f"**missed**: {total - count} of {total} are not"


def paragraph(*sentences: str) -> str:
    """Returns a paragraph with one sentence per line. Empty sentences are left out."""
    return "\n".join(" ".join(sentence.split()) for sentence in sentences if sentence)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Returns a Markdown table. The columns with these indices are aligned to the right."""
    rules = ["---:" if column in numbers else "---" for column in range(len(head))]
    lines = [head, rules, *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def summary(goals: Sequence[tuple[str, str]]) -> str:
    """Returns a sentence about the goals that are met. Each pair is a name and its verdict, `met` or not."""
    missed = [what for what, verdict in goals if verdict != "met"]
    text = f"{len(goals) - len(missed)} of {len(goals)} numbers that have a goal meet it."
    return f"{text} Missed: {'; '.join(missed)}." if missed else text
