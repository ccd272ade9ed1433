"""Runs every code block of docs/MANY.md, and compares what the parts make with what one process makes.

    page.py WSTAC      the command `wstac`

A worker of Dask is killed at work. Slurm is not needed: the script of its array runs once for each task.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy

PAGE = Path(__file__).resolve().parents[2] / "docs/MANY.md"
# The study of the page takes an hour.
SMALL = "wstac trade --slides 1 --model builtin:svm"
# Kills the process that starts the second part for the first time, and makes it all the same.
KILLER = """#!/bin/bash
if [[ "$*" == *"--units 500..1000 "* ]] && mkdir killed 2> /dev/null; then kill -KILL $PPID; fi
exec "$WSTAC" "$@"
"""


class Runner:
    """Runs blocks in a folder."""

    def __init__(self, folder: Path, wstac: Path) -> None:
        self.folder, tools = folder, folder / "tools"
        tools.mkdir()
        (tools / "wstac").symlink_to(wstac)
        self.environment = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}", "WSTAC": str(wstac)}

    def bash(self, text: str, **more: str) -> None:
        """Runs commands of bash."""
        subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=self.folder, env=self.environment | more, check=True)

    def python(self, text: str, name: str, *arguments: str) -> None:
        """Runs a program of Python from a file, as Dask needs it."""
        (self.folder / name).write_text(text)
        subprocess.run([sys.executable, name, *arguments], cwd=self.folder, env=self.environment, check=True)

    def check_set(self, join: str, way: str) -> None:
        """Puts parts together, compares them with the whole set, and removes them."""
        self.python(join, "join.py")
        whole, joined = numpy.load(self.folder / "whole.npz"), numpy.load(self.folder / "set.npz")
        assert whole.files == joined.files, (way, joined.files)
        for name in whole.files:
            same = whole[name].dtype == joined[name].dtype and whole[name].tobytes() == joined[name].tobytes()
            assert same and whole[name].shape == joined[name].shape, f"{way}: {name} differs from that of one process"
        for part in self.folder.glob("part-*.npz"):
            part.unlink()


def main() -> None:
    """Runs the page."""
    blocks = re.findall(r"^```(sh|bash|python)\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    assert [language for language, _ in blocks] == ["sh", "python", "bash", "python", "sh"], blocks
    loop, join, slurm, dask, study = (text for _, text in blocks)
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(Path(folder), Path(sys.argv[1]).resolve())
        runner.bash(loop)
        assert (runner.folder / "my.wsm").stat().st_size > 0
        runner.bash("wstac dataset sweep.toml --input path -o whole.npz")
        runner.check_set(join, "the shell loop")

        first, last = re.search(r"--array=(\d+)-(\d+)", slurm).groups()
        for task in reversed(range(int(first), int(last) + 1)):
            runner.bash(slurm, SLURM_ARRAY_TASK_ID=str(task))
        runner.check_set(join, "the Slurm array")

        tool = runner.folder / "tools/wstac"
        tool.unlink()
        tool.write_text(KILLER)
        tool.chmod(0o755)
        runner.python(dask, "parts.py", "2000", "500")
        assert (runner.folder / "killed").exists(), "no worker was killed"
        runner.check_set(join, "Dask")

        runner.bash(study.replace("wstac trade --units", f"{SMALL} --units"))
        runner.bash(f"{SMALL} -o whole && cmp whole/map.csv found/map.csv && cmp whole/trade.csv found/trade.csv && cmp whole/base.toml found/base.toml")
    print("parts equal one process: a shell loop, a Slurm array, Dask with a killed worker, the map of a study")


if __name__ == "__main__":
    main()
