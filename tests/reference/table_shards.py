"""The results of table 2 by several processes, on one or many machines.

A shard has every Nth job, from the Kth on. Its first line is a header: shard, number of shards, what the results depend
on, and a digest of the lines that follow. The merged file equals that of one process, byte for byte.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from argparse import ArgumentTypeError
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

Job = tuple[str, int]
"""A kind of results and a repeat, from 0."""


class Header(NamedTuple):
    """The first line of a shard."""

    shard: int
    of: int
    made_by: str
    """What the results depend on: sources and versions."""
    jobs: list[Job]
    """All jobs of the set, in the order of their lines."""

    def own(self) -> list[Job]:
        """Returns the jobs of this shard."""
        return self.jobs[self.shard - 1::self.of]


def numbers(text: str) -> tuple[int, int]:
    """Reads K/N."""
    shard, _, of = text.partition("/")
    if not (shard.isdecimal() and of.isdecimal() and 1 <= int(shard) <= int(of)):
        raise ArgumentTypeError(f"{text!r} is no shard, expected K/N: 1/8 to 8/8 for eight")
    return int(shard), int(of)


def job_of(line: str) -> Job:
    """Returns the job of a line of results."""
    one = json.loads(line)
    return one["kind"], one["repeat"]


def run(jobs: Sequence[Job], file: Path, do: Callable[[Job], str], workers: int) -> None:
    """Does the jobs, and adds a line for each that is missing in the file, in their order.

    A last line that a killed process left without an end is dropped.
    """
    text = file.read_text() if file.exists() else ""
    there = text[:text.rfind("\n") + 1]
    if there != text:
        file.write_text(there)
    done = {job_of(line) for line in there.splitlines()}
    with ThreadPoolExecutor(workers) as pool, file.open("a") as out:
        running: list[tuple[Job, Future[str]]] = [(job, pool.submit(do, job)) for job in jobs if job not in done]
        for (kind, repeat), result in running:
            print(result.result(), file=out, flush=True)
            print(f"{kind}: repeat {repeat + 1}", file=sys.stderr, flush=True)


def in_order(jobs: Sequence[Job], lines: Sequence[str]) -> str:
    """Returns the lines in the order of the jobs."""
    found = {job_of(line): line for line in lines}
    return "".join(f"{found[job]}\n" for job in jobs)


def make(header: Header, file: Path, do: Callable[[Job], str], workers: int) -> None:
    """Makes a shard. The file takes its name when it is whole; until then FILE.part keeps what is done."""
    if header.of > len(header.jobs):
        raise SystemExit(f"{file}: {header.of} shards, expected at most {len(header.jobs)}, one per job")
    if file.exists():
        if read(file)[0] == header:
            print(f"{file}: shard {header.shard}/{header.of} is already there", file=sys.stderr)
            return
        raise SystemExit(f"{file}: exists already and is another shard, expected a new file")
    # What another version began is not continued.
    made_by = hashlib.sha256(repr(header).encode()).hexdigest()[:16]
    part = file.with_name(f"{file.name}.{made_by}.part")
    run(header.own(), part, do, workers)
    lines = in_order(header.own(), part.read_text().splitlines())
    head = json.dumps({**header._asdict(), "sha256": hashlib.sha256(lines.encode()).hexdigest()})
    whole = file.with_name(f"{file.name}.{os.getpid()}.tmp")
    whole.write_text(f"{head}\n{lines}")
    whole.replace(file)
    part.unlink(missing_ok=True)


def read(file: Path) -> tuple[Header, list[str]]:
    """Reads a whole shard: its header and lines."""
    first, end, rest = file.read_text(errors="replace").partition("\n")
    try:
        found: dict[str, Any] = json.loads(first)
        sha256 = found.pop("sha256")
        found["jobs"] = [(kind, repeat) for kind, repeat in found["jobs"]]
        header = Header(**found)
    except (ValueError, TypeError, KeyError, AttributeError):
        raise SystemExit(f"{file}: is no shard, expected a file of ci/train table --shard") from None
    if not end or hashlib.sha256(rest.encode()).hexdigest() != sha256:
        raise SystemExit(f"{file}: is damaged, expected a whole shard: make it again")
    lines = rest.splitlines()
    if [job_of(line) for line in lines] != header.own():
        raise SystemExit(f"{file}: has lines of other jobs than shard {header.shard}/{header.of}: make it again")
    return header, lines


def merged(files: Sequence[Path]) -> str:
    """Returns the results of all shards of a set, in any order of the files."""
    shards = list(everything(files))
    first = shards[0][0]
    missing = [f"{n}/{first.of}" for n in range(1, first.of + 1) if n not in {header.shard for header, _ in shards}]
    if missing:
        raise SystemExit(f"merge: {len(missing)} of {first.of} shards are missing, expected all: {', '.join(missing[:20])}")
    return in_order(first.jobs, [line for _, lines in shards for line in lines])


def everything(files: Sequence[Path]) -> Iterator[tuple[Header, list[str]]]:
    """Reads shards of one set, each once."""
    seen: dict[int, Path] = {}
    first: Header | None = None
    for file in files:
        header, lines = read(file)
        first = first or header
        if header._replace(shard=first.shard) != first:
            what = "sources or versions" if header.made_by != first.made_by else "jobs or number of shards"
            raise SystemExit(f"{file}: is of other {what} than {files[0]}, expected the same")
        if header.shard in seen:
            other = seen[header.shard]
            raise SystemExit(f"{file}: is shard {header.shard}/{header.of}, as is {other}, expected each once")
        seen[header.shard] = file
        yield header, lines
