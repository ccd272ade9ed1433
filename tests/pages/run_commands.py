"""Runs every command of README.md and of the pages in docs/, or names why it is not run.

    run_commands.py WSTAC NODE [PAGE…]      the commands `wstac` and `wstac-node`

The commands of a page run one after the other in an empty folder, which has links to the folders of this repository.
commands.toml lists the commands that are not run, with the reason, and what takes the place of hardware. Of a command that is
not run, the options of `wstac` and `wstac-node` are checked. A command that fails, or that prints other things than a ```text
block behind it says, fails the page; so does an entry of the list that matches no command. docs/tutorials are run by ci/pages tutorials.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import commands
import rules
import running
import tutorial
from tutorial import ROOT, Wrong

LIST = Path(__file__).with_name("commands.toml")
# A single command; a page has some minutes in all.
PATIENCE = 600


class Page:
    """A page whose commands are run in a folder of their own."""

    def __init__(self, name: str, folder: Path, programs: dict[str, Path], known: rules.Rules) -> None:
        self.name, self.known, self.programs = name, known, programs
        self.shell = tutorial.Shell(programs["wstac"], folder)
        self.place, tools = folder / "page", folder / "tools"
        (tools / "wstac-node").symlink_to(programs["wstac-node"])
        for one in ROOT.iterdir():
            if one.name.startswith("LICENSE-") or (one.is_dir() and one.name[0] != "." and one.name not in ("target", "docs", "wstac")):
                (self.place / one.name).symlink_to(one)
        self.environment = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}"}
        self.counts = {"run": 0, "named": 0}

    def close(self) -> None:
        """Ends the page's shell."""
        self.shell.close()

    def in_shell(self, text: str) -> str:
        """Runs commands in the shell of the page. One that takes too long is killed."""
        late = threading.Timer(PATIENCE, os.killpg, (self.shell.process.pid, signal.SIGKILL))
        late.start()
        try:
            return self.shell.run(text)
        finally:
            late.cancel()

    def run(self, text: str, words: str) -> str:
        """Runs one command, and returns what it prints. Of services and screens that is nothing."""
        for rule in self.known.service:
            if rule.takes(self.name, words):
                more = rule.given.get("more", "").replace("PORT", str(free_port()))
                running.service(f"{words} {more}", self.place, self.environment, rule.given["says"])
                return ""
        for rule in self.known.screen:
            if rule.takes(self.name, words):
                running.screen(words, self.place, self.environment, rule.given["says"])
                return ""
        return self.in_shell(text)

    def command(self, command: commands.Command) -> str | None:
        """Runs a command, and returns what it prints, or `None` if it is only named."""
        words = command.words()
        if why := self.known.named_by(self.name, words):
            subprocess.run(["bash", "-n", "-c", command.text], check=True)
            for one in tutorial.commands(command.text) if "wstac" in words else ():
                if fault := self.unknown(one):
                    raise Wrong(f"{words}: {fault} (it is not run: {why})")
            self.counts["named"] += 1
            return None
        text = self.known.replaced(self.name, command.text)
        try:
            printed = self.run(text, commands.Command(command.line, text).words())
        except Wrong as error:
            raise Wrong(f"{words}: {error}") from None
        self.counts["run"] += 1
        return printed

    def unknown(self, words: list[str]) -> str | None:
        """Returns what is wrong with the options of a command of this project that is not run, or `None`."""
        if words[0] == "wstac-node":
            done = subprocess.run([self.programs["wstac-node"], *words[1:], "--help"], capture_output=True, text=True)
            return None if done.returncode == 0 else done.stderr.strip()
        # A variable of the shell has no value here.
        return None if "$" in "".join(words) else tutorial.unknown(words, self.programs["wstac"])

    def check(self, found: list[commands.Block]) -> list[str]:
        """Runs all commands, and returns what is wrong."""
        problems = []
        if before := self.known.prepare.get(self.name):
            self.in_shell(before)
        for block in found:
            printed: list[str] = []
            for command in block.commands:
                try:
                    printed.append(self.command(command) or "")
                except (Wrong, subprocess.CalledProcessError) as error:
                    problems.append(f"{self.name}:{command.line}: {error}")
                    if self.shell.process.poll() is not None or "a command failed" in str(error) or "the shell ended" in str(error):
                        # What follows may need what this command makes, and the shell has ended.
                        return problems
            if block.expected is not None and (why := tutorial.difference(block.expected, "".join(printed))):
                problems.append(f"{self.name}:{block.commands[0].line}: {why}; the commands printed:\n{''.join(printed)}")
        return problems


def free_port() -> int:
    """Returns a port of 127.0.0.1 that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def tutorials() -> list[str]:
    """Returns the tutorials that ci/pages tutorials does not run."""
    default = re.search(r"\|\| set -- (.*)$", (ROOT / "ci/pages").read_text(), re.MULTILINE)
    names = set(default[1].split()) if default else set()
    return [f"{page.relative_to(ROOT)}: ci/pages tutorials does not run it" for page in (ROOT / "docs/tutorials").glob("*.md") if page.stem not in names]


def main() -> None:
    """Runs the commands of the pages."""
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    programs = {name: Path(path).resolve() for name, path in zip(("wstac", "wstac-node"), sys.argv[1:3], strict=True)}
    known = rules.load(LIST)
    pages = [Path(name).resolve() for name in sys.argv[3:]] or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    problems, counts, read = tutorials(), {"run": 0, "named": 0}, set()
    for path in pages:
        name = str(path.relative_to(ROOT))
        try:
            found = commands.blocks(path.read_text(encoding="utf-8"))
        except Wrong as error:
            sys.exit(f"pages: {name}: {error}")
        if not found:
            continue
        read.add(name)
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            page = Page(name, Path(folder).resolve(), programs, known)
            try:
                problems += page.check(found)
            except Wrong as error:
                problems.append(f"{name}: its preparation: {error}")
            finally:
                page.close()
        for what, count in page.counts.items():
            counts[what] += count
        print(f"pages: {name}: {page.counts['run']} run, {page.counts['named']} named, {time.monotonic() - start:.0f} s", flush=True)
    if not sys.argv[3:]:
        problems += [f"{LIST.relative_to(ROOT)}: {one}" for one in known.unused(read)]
    print("\n".join(problems), file=sys.stderr, end="\n" if problems else "")
    print(f"pages: {counts['run']} commands run, {counts['named']} named with the reason, {len(problems)} wrong")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
