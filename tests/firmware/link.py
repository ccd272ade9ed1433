"""Tests the live link: an emulated board's UART on a socket, and `wstac monitor` at its other end, which requests its
outputs.
"""

import json
import socket
import subprocess
import sys

import boards


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def check(board, elf, folder, wstac, expected):
    """Compares the output with the lines of `wstac run --json --features --samples` on the same frames."""
    port = free_port()
    # The board starts when the host is there.
    command = boards.command(board, elf, f"tcp:127.0.0.1:{port},server=on,wait=on")
    qemu = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(100):
            asked = [wstac, "monitor", f"tcp:127.0.0.1:{port}", "--json", "--features", "--samples"]
            done = subprocess.run(asked, capture_output=True, text=True, timeout=300, check=False)
            if done.stdout or qemu.poll() is not None:
                break
    finally:
        qemu.kill()
        qemu.wait()
    got = done.stdout.splitlines()
    if done.returncode:
        sys.exit(f"{board.core}: wstac monitor failed ({done.returncode}): {done.stderr.strip()}")
    kind = lambda line: json.loads(line)["kind"]
    got_features = [line for line in got if kind(line) == "features"]
    if [line for line in got if kind(line) != "features"] != [line for line in expected if kind(line) != "features"]:
        sys.exit(f"{board.core}: events over the live link are not the host's: {done.stderr.strip()}")
    # The request takes some time to arrive. After that, the features of every frame are there.
    want_features = [line for line in expected if kind(line) == "features"]
    if not got_features or got_features != want_features[-len(got_features) :]:
        sys.exit(f"{board.core}: features over the live link are not the host's: {len(got_features)} of them")
    return f"over its UART live: {len(got) - len(got_features)} records with samples, features of {len(got_features)} frames"
