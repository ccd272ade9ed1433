"""Checks sets in shards: with GNU parallel, with Dask, and as the tasks of a Slurm array, without Slurm. Workers are killed.
Each merged set must equal that of one process, byte for byte.

    check.py WSTAC FOLDER    slides over time, random slides, recordings, and a study of `wstac trade`, all in
                             an empty folder; needs Dask (requirements.txt)
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import NoReturn

HERE = Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "docs/MANY.md"
# A command whose first process for shard 3 is killed at work.
KILLED = """#!/bin/bash
if [[ "$*" == *"--shard 3/"* ]] && mkdir "$MARK" 2> /dev/null; then
    "$PROGRAM" "$@" &
    sleep 0.02
    kill -KILL $!
    wait $!
    echo $? > "$MARK/status"
    exit 137 # or parallel would never see that the job failed
fi
exec "$PROGRAM" "$@"
"""
# A command for shard 3 whose first worker is killed, but not the command: it goes on beside that of another worker.
WORKER_KILLED = """#!/bin/bash
if [[ "$*" == *"--shard 3/"* ]] && mkdir "$MARK" 2> /dev/null; then
    kill -KILL $PPID
    "$PROGRAM" "$@" 2> "$MARK/said"
    echo $? > "$MARK/status"
    exit
fi
exec "$PROGRAM" "$@"
"""


def fail(message: str) -> NoReturn:
    sys.exit(f"many: {message}")


def run(*command: str | Path, **variables: str | Path) -> None:
    """Runs a command with variables; what it prints is shown only if it fails."""
    every = os.environ | {name: str(value) for name, value in variables.items()}
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=every)
    if done.returncode:
        fail(f"{' '.join(map(str, command))} failed ({done.returncode}):\n{done.stdout}")


class Sets:
    """Sets of one process in a folder, and the same in shards."""

    def __init__(self, wstac: str, at: Path) -> None:
        self.wstac = wstac
        self.at = at

    def whole(self) -> None:
        """Makes the sets in one process."""
        (self.at / "sweep.toml").write_text("slides = 20\nspeeds = [100, 150, 220]\ndirections = [0, 90]\n")
        (self.at / "random.toml").write_text("slides = 60\nsensors = 10\n")
        recordings = self.at / "recordings"
        recordings.mkdir()
        for name in ("Fla0", "Saw3", "Tri4"):
            run(self.wstac, "record", f"scene:{name}@150", "-o", recordings / f"{name}.mcap", "--features-only", "--label", f"specimen={name}")
        run(self.wstac, "dataset", self.at / "sweep.toml", "-o", self.at / "sweep.npz")
        run(self.wstac, "dataset", self.at / "random.toml", "--input", "taxel-path", "-o", self.at / "random.npz")
        run(self.wstac, "dataset", recordings, "--input", "path", "-o", self.at / "recordings.npz")
        run(self.wstac, "trade", "--slides", "1", "--model", "builtin:svm", "--no-times", "-o", self.at / "trade")

    def script(self, name: str, text: str) -> Path:
        (self.at / name).write_text(text)
        (self.at / name).chmod(0o755)
        return self.at / name

    def merged(self, folder: Path, whole: str) -> None:
        """Merges the shards of a folder, and compares the set with that of one process."""
        run(self.wstac, "dataset", "merge", *sorted(folder.glob("*.shard")), "-o", folder / "set.npz")
        if (folder / "set.npz").read_bytes() != (self.at / whole).read_bytes():
            fail(f"the shards of {folder.name} make another set than {whole}")

    def parallel(self) -> None:
        mark, folder = self.at / "mark", self.at / "a folder"
        command = self.script("killed once", KILLED)
        run(HERE / "parallel.sh", folder, "5", command, "dataset", self.at / "sweep.toml", JOBS="2", PROGRAM=self.wstac, MARK=mark)
        if status(mark) != "137":
            fail("no job was killed at work")
        self.merged(folder, "sweep.npz")

    def dask(self) -> None:
        mark, folder = self.at / "mark2", self.at / "dask"
        command = [self.script("worker killed once", WORKER_KILLED), "dataset", self.at / "random.toml", "--input", "taxel-path"]
        run(sys.executable, HERE / "dask_shards.py", "--workers", "2", folder, "5", *command, PROGRAM=self.wstac, MARK=mark)
        for _ in range(100):
            if (mark / "status").exists():
                break
            time.sleep(0.1)
        if status(mark) != "0":
            fail("the killed worker's command did not succeed")
        self.merged(folder, "random.npz")
        # A shard that cannot be made is named, and the exit code tells.
        none = [self.wstac, "dataset", self.at / "none.toml"]
        command = [sys.executable, HERE / "dask_shards.py", "--workers", "1", self.at / "failed", "2", *none]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode == 0:
            fail("a set without its sweep succeeded")
        if not re.search(r"shard 2/2: exit code 1: .*none.toml", done.stderr):
            fail(f"the shard that cannot be made is not named:\n{done.stderr}")

    def array(self) -> None:
        folder = self.at / "array"
        folder.mkdir()
        for task in ("3", "1", "2"):
            variables = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_CPUS_PER_TASK": "2"}
            run(HERE / "slurm.sh", folder, self.wstac, "dataset", self.at / "recordings", "--input", "path", **variables)
        self.merged(folder, "recordings.npz")

    def page(self) -> None:
        """Runs the first commands of the page, as they stand there."""
        folder = self.at / "page"
        folder.mkdir()
        commands = PAGE.read_text(encoding="utf-8").split("```sh\n", 1)[1].split("```\n", 1)[0]
        path = f"{Path(self.wstac).parent}:{os.environ['PATH']}"
        run("bash", "-euo", "pipefail", "-c", f"cd {folder}\n{commands}", PATH=path)
        if not (folder / "my.wsm").stat().st_size:
            fail(f"the first commands of {PAGE} made no model")

    def study(self) -> None:
        run(HERE / "parallel.sh", self.at / "study", "3", self.wstac, "trade", "--slides", "1", "--model", "builtin:svm", JOBS="2")
        shards = sorted((self.at / "study").glob("*.shard"))
        run(self.wstac, "trade", "--merge", *shards, "--no-times", "-o", self.at / "merged")
        run("diff", "-r", self.at / "trade", self.at / "merged")


def status(mark: Path) -> str:
    """Returns the exit code that a killed process or its command has left."""
    file = mark / "status"
    return file.read_text().strip() if file.exists() else ""


def main() -> None:
    sets = Sets(sys.argv[1], Path(sys.argv[2]))
    for part in (sets.whole, sets.parallel, sets.dask, sets.array, sets.page, sets.study):
        part()
    print("shards equal one process: slides over time (parallel), random slides (Dask), recordings (array), trade")


if __name__ == "__main__":
    main()
