#!/usr/bin/env python3
"""Makes all shards of a set with Dask: dask_shards.py [OPTION] FOLDER SHARDS COMMAND…

COMMAND is that of one process without its output, such as: wstac dataset sweep.toml
OPTION is --workers N for so many processes on this machine, or --scheduler ADDRESS of a cluster.
The same command again makes the shards that failed or are missing. Needs the package `distributed` of PyPI.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from distributed import Client, LocalCluster, as_completed

RETRIES = 3
"""A command that fails is started again so often. A shard whose worker is killed is made again by another, too."""


def make(command: list[str], folder: str, shard: int, of: int) -> str:
    """Makes a shard on a worker. Returns what the command said.

    A command whose worker was killed may go on meanwhile: both write to temporary names, and the second keeps what it
    finds.
    """
    whole = [*command, "--shard", f"{shard}/{of}", "-o", f"{folder}/{shard}.shard"]
    environment = {"RAYON_NUM_THREADS": "1", **os.environ}
    done = subprocess.run(whole, env=environment, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        raise RuntimeError(f"shard {shard}/{of}: exit code {done.returncode}: {done.stderr.strip()[-1000:]}")
    return done.stderr.strip()


def make_all(client: Client, command: list[str], folder: Path, of: int) -> int:
    """Makes all shards, and returns how many failed."""
    failed = 0
    numbers = range(1, of + 1)
    shards = [client.submit(make, command, str(folder), number, of, retries=RETRIES, pure=False) for number in numbers]
    for done in as_completed(shards):
        error = done.exception()
        print(error or done.result(), file=sys.stderr, flush=True)
        failed += error is not None
    return failed


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="make all shards of a set with Dask")
    parser.add_argument("folder", type=Path, help="where to write them; all workers see it by this name")
    parser.add_argument("shards", type=int, help="their number")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, help="processes on this machine; by default, one per processor")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a cluster, such as tcp://HOST:8786")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="the command of one process without its output")
    arguments = parser.parse_args()
    if arguments.shards < 1 or not arguments.command:
        parser.error("expected at least 1 shard, and a command")
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if arguments.scheduler:
        with Client(arguments.scheduler) as client:
            failed = make_all(client, arguments.command, folder, arguments.shards)
    else:
        # Nobody else on the network reaches it, and it has no page.
        count = arguments.workers or os.cpu_count()
        with LocalCluster(
            n_workers=count, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
        ) as cluster, Client(cluster) as client:
            failed = make_all(client, arguments.command, folder, arguments.shards)
    if failed:
        print(f"{failed} of {arguments.shards} shards failed: start the same command again", file=sys.stderr)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
