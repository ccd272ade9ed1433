"""Text from outside that may go to a terminal, by the rules of `visible.rs` of wstac-host."""

from __future__ import annotations

import unicodedata

# Those that turn the direction of writing, and breaks of lines and paragraphs.
_TURNING = {0x61C, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A)}


def _escaped(text: str, kept: str) -> str:
    controls = (c not in kept and (unicodedata.category(c) == "Cc" or ord(c) in _TURNING) for c in text)
    return "".join(f"\\u{ord(c):04x}" if is_control else c for c, is_control in zip(text, controls))


def lines(text: str) -> str:
    """Returns a text of several lines in which no character controls a terminal. Line feeds and tabs stay."""
    return _escaped(text, "\n\t")


def line(text: str) -> str:
    """Returns a text that is one line and in which no character controls a terminal."""
    return _escaped(text, "")
