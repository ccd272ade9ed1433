"""Answers as the golden vectors have them."""

from dataclasses import asdict
from typing import Any

# Exponentials, logarithms and angles differ in their last digits from processor to processor, and a small deviation
# by 2e-8 of itself. Whoever reads the vectors allows for 5e-4 or more.
DIGITS = 6


def stored(answer: Any) -> dict[str, Any]:
    """The fields of an answer, its numbers with six significant digits."""
    rounded = lambda value: float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
    return {name: rounded(value) for name, value in asdict(answer).items()}
