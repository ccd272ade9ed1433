"""Finds the commands of a page: those of its ```sh blocks and of its indented blocks, one after the other, with their outputs."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass

import pages
import tutorial

# An indented block with a line that begins so has commands.
BEGIN = re.compile(
    r"    (?:ci/\w|tests/\w|[A-Z_]+=\S+ \w|wstac-node[ /]|"
    r"(?:arm-none-eabi-\w+|cargo|cc|cmake|export|ffmpeg|git|mkdir|mkdocs|openssl|pip|printf|python3?|ros2|rustup|sudo|west|wstac) )"
)
INDENTED = "    "


@dataclass
class Command:
    """A command of a page, with all of its lines."""

    line: int
    """The number of its first line."""
    text: str
    """Its lines, without the indentation of the block."""

    def words(self) -> str:
        """Returns the command without comments, in one line."""
        lines = (re.sub(r"(?:^|\s+)# .*$", "", line) for line in self.text.replace("\\\n", " ").splitlines())
        return "; ".join(" ".join(line.split()) for line in lines if line.strip())


@dataclass
class Block:
    """A block of commands, and what the page says that they print."""

    commands: list[Command]
    expected: str | None


def is_complete(text: str) -> bool:
    """Tells whether lines are whole commands for bash."""
    done = subprocess.run(["bash", "-n"], input=text, capture_output=True, text=True)
    return done.returncode == 0 and not done.stderr and not text.rstrip("\n").endswith("\\")


def split(text: str, first: int) -> Iterator[Command]:
    """Yields the commands of a block whose first line has a number."""
    lines: list[str] = []
    for number, line in enumerate(text.splitlines(), first):
        if not lines and not re.sub(r"^\s*#.*", "", line).strip():
            continue
        lines.append(line)
        if is_complete(joined := "".join(f"{one}\n" for one in lines)):
            yield Command(number - len(lines) + 1, joined)
            lines = []
    if lines:
        raise tutorial.Wrong(f"line {first}: a command does not end")


def indented(text: str) -> Iterator[tuple[int, str]]:
    """Yields the number of the first line and the text of each indented block of commands."""
    fence, lines, before = None, [], ""
    # A last line ends the last block.
    for number, line in enumerate([*text.splitlines(), "end"], 1):
        mark = pages.FENCE.match(line)
        inside = fence is not None
        if mark:
            fence = None if inside and mark[1].startswith(fence) else fence or mark[1]
        if not inside and not mark and line.startswith(INDENTED) and (lines or not before.strip()):
            lines.append(line)
        elif lines:
            if any(BEGIN.match(one) for one in lines):
                yield number - len(lines), "".join(f"{one.removeprefix(INDENTED)}\n" for one in lines)
            lines = []
        before = line


def blocks(text: str) -> list[Block]:
    """Returns the blocks of commands of a page in their order."""
    found = [(first, Block(list(split(block, first)), None)) for first, block in indented(text)]
    last = None
    for block in tutorial.blocks(text):
        if block.words[:1] == ["sh"]:
            last = Block(list(split(block.text, block.line + 1)), None)
            found.append((block.line, last))
            continue
        if block.words == ["text"] and last and last.expected is None and between(text, last, block.line):
            last.expected = block.text
        last = None
    return [block for _, block in sorted(found, key=lambda one: one[0])]


def between(text: str, block: Block, line: int) -> bool:
    """Tells whether there is no heading between a block and a line: then the line's block is the output."""
    if not block.commands:
        return False
    lines = text.splitlines()[block.commands[-1].line : line - 1]
    return not any(pages.HEADING.match(one) for one in lines)
