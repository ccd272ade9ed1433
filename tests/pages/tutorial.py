"""Runs every command of a tutorial, and compares what it prints with what the page shows.

    tutorial.py WSTAC PAGE…      WSTAC is the command `wstac`

A page has three kinds of code blocks that count here:

- ```sh: commands. All blocks of a page run one after the other in one shell, in an empty folder. The folder has a link
  `wstac` to this repository, as if it had been cloned there. A command that fails, fails the page.
- ```text behind it: what the commands print. `…` stands for any part of a line, and a line `…` for any lines.
- ```sh hardware: commands that need a board or a camera. They are not run. Their syntax is checked, and the options of
  `wstac`, and that the programs and features of `cargo` are there.

A block of another language (rust, c, python) shows a file: the one that the last link before it names, all of it.
"""

from __future__ import annotations

import contextlib
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pages

ROOT = Path(__file__).resolve().parents[2]
SHOWN = {"c", "python", "rust"}
# Prints the end of a block, and how its last command ended.
MARK = "tutorial-block-ends"


class Wrong(Exception):
    """What is wrong with a page."""


@dataclass
class Block:
    """A code block of a page."""

    line: int
    """The number of the line of its fence."""
    words: list[str]
    """The words behind the fence."""
    text: str
    """Its lines."""
    link: str | None
    """The last link before it."""


def blocks(text: str) -> Iterator[Block]:
    """Yields the fenced code blocks of a page."""
    link = fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = pages.FENCE.match(line)
        if fence is None and mark:
            fence, lines, start = mark[1], [], number
            words = line.strip().strip("`~").split()
        elif fence and mark and mark[1].startswith(fence) and line.strip() == mark[1]:
            yield Block(start, words, "".join(f"{one}\n" for one in lines), link)
            fence = None
        elif fence:
            lines.append(line)
        elif found := pages.LINK.findall(line):
            link = found[-1]
    if fence:
        raise Wrong(f"line {start}: the code block does not end")


def difference(expected: str, found: str) -> str | None:
    """Returns the first expected line that is not there, or `None`. `…` stands for any part of a line, and alone for any lines."""
    parts, last = [], ""
    for line in expected.splitlines():
        whole = line.strip() == "…"
        parts.append(r"(?:.*\n)*?" if whole else ".*".join(map(re.escape, line.split("…"))) + r" *\n")
        last = line
        # The part up to here must fit, so that the message names the line at which it ceases to.
        if not re.match("".join(parts), found):
            return f"there is no line {last!r}"
    return None if re.fullmatch("".join(parts), found) else "there are more lines"


class Shell:
    """One shell that runs the blocks of a page."""

    def __init__(self, wstac: Path, folder: Path) -> None:
        tools = folder / "tools"
        tools.mkdir()
        (tools / "wstac").symlink_to(wstac)
        self.block = folder / "block.sh"
        place = folder / "page"
        place.mkdir()
        (place / "wstac").symlink_to(ROOT)
        self.process = subprocess.Popen(
            ["bash", "--noprofile", "--norc"], cwd=place, text=True, bufsize=1, errors="replace",
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        assert self.process.stdin
        self.process.stdin.write(f"set -E; trap 'printf \"\\n{MARK} %s\\n\" $?; exit 1' ERR\n")
        self.run(f"export PATH={shlex.quote(str(tools))}:$PATH PIP_QUIET=1 PIP_DISABLE_PIP_VERSION_CHECK=1 CARGO_TERM_QUIET=true")

    def run(self, commands: str) -> str:
        """Runs commands, and returns what they print. The first one that fails ends them."""
        assert self.process.stdin and self.process.stdout
        # Sourced, so that variables and folders stay, and programs do not read the next commands as their input.
        self.block.write_text(commands)
        self.process.stdin.write(f". {shlex.quote(str(self.block))} < /dev/null; echo; echo {MARK} 0\n")
        printed = []
        for line in self.process.stdout:
            if line.startswith(f"{MARK} "):
                # The mark's own line break.
                text = "".join(printed).removesuffix("\n")
                if (code := line.split()[1]) != "0":
                    raise Wrong(f"a command failed with exit code {code}:\n{text}")
                return text
            printed.append(line)
        raise Wrong(f"the shell ended:\n{''.join(printed)}")

    def close(self) -> None:
        """Ends the shell."""
        assert self.process.stdin
        # A shell that has ended does not take the rest.
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        self.process.wait()
        assert self.process.stdout
        self.process.stdout.close()


def commands(text: str) -> Iterator[list[str]]:
    """Yields the words of each simple command of a block that is not run."""
    for line in text.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        found: list[str] = []
        for word in lexer:
            if set(word) <= set("();<>|&"):
                if found:
                    yield found
                found = []
            else:
                found.append(word)
        if found:
            yield found


def unknown(command: list[str], wstac: Path) -> str | None:
    """Returns what is wrong with a command that needs hardware, or `None`."""
    while command and re.match(r"^\w+=", command[0]):
        command = command[1:]
    if command[:1] == ["wstac"]:
        # The arguments before --help are judged first.
        done = subprocess.run([wstac, *command[1:], "--help"], capture_output=True, text=True)
        return None if done.returncode == 0 else done.stderr.strip()
    if command[:1] == ["cargo"] and len(command) > 1 and command[1] in ("build", "run"):
        manifest = tomllib.loads((ROOT / "wstac-fw/Cargo.toml").read_text())
        given = dict(zip(command, command[1:]))
        if (program := given.get("--bin")) and program not in [one["name"] for one in manifest["bin"]]:
            return f"wstac-fw has no program {program}"
        for feature in filter(None, given.get("--features", "").split(",")):
            if feature not in manifest["features"]:
                return f"wstac-fw has no feature {feature}"
    return None


def check(page: Path, shell: Shell, wstac: Path) -> int:
    """Checks a page, and returns the number of blocks that were run."""
    name = page.relative_to(ROOT) if page.is_relative_to(ROOT) else page.name
    found = list(blocks(page.read_text(encoding="utf-8")))
    runs, printed = 0, None
    for block in found:
        where = f"{name}:{block.line}"
        language, *more = block.words or [""]
        try:
            if language == "sh" and not more:
                printed, runs = shell.run(block.text), runs + 1
                continue
            if (language, more) == ("sh", ["hardware"]):
                subprocess.run(["bash", "-n", "-c", block.text], check=True)
                for command in commands(block.text):
                    if why := unknown(command, wstac):
                        raise Wrong(f"{shlex.join(command)}: {why}")
            elif language == "text":
                if printed is None:
                    raise Wrong("no commands come before this output")
                if why := difference(block.text, printed):
                    raise Wrong(f"{why}; the commands printed:\n{printed}")
            elif language in SHOWN:
                file = (page.parent / (block.link or "")).resolve()
                if not file.is_file() or file.read_text(encoding="utf-8") != block.text:
                    raise Wrong(f"the block differs from {block.link}")
            else:
                raise Wrong(f"the block is {' '.join(block.words)!r}, expected sh, sh hardware, text, {', '.join(sorted(SHOWN))}")
        except (Wrong, subprocess.CalledProcessError) as error:
            raise Wrong(f"{where}: {error}") from None
        printed = None
    if runs == 0:
        raise Wrong(f"{name}: no block was run")
    return runs


def main() -> None:
    """Checks the pages."""
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    wstac = Path(sys.argv[1]).resolve()
    for name in sys.argv[2:]:
        page, start = Path(name).resolve(), time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            shell = Shell(wstac, Path(folder))
            try:
                runs = check(page, shell, wstac)
            except Wrong as error:
                sys.exit(f"tutorial: {error}")
            finally:
                shell.close()
        print(f"tutorial: {page.relative_to(ROOT)}: {runs} blocks in {time.monotonic() - start:.0f} s")


if __name__ == "__main__":
    main()
