"""Runs services and programs with a screen until they are ready, and ends them as a user would."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import tempfile
import termios
import time
from pathlib import Path

from tutorial import Wrong

# Nothing takes longer on a loaded machine.
PATIENCE = 120


def kill(process: subprocess.Popen) -> None:
    """Ends a program that still runs, with all that it has started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def service(command: str, place: Path, environment: dict[str, str], says: str) -> None:
    """Starts a service, waits until it has said something, and ends it by SIGINT. It may end before that, if it succeeds."""
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            ["bash", "-c", f"exec {command}"], cwd=place, env=environment,
            stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip

        def text() -> str:
            said.seek(0)
            return said.read()

        try:
            end = time.monotonic() + PATIENCE
            while says not in text():
                if process.poll() is not None:
                    raise Wrong(f"ended with exit code {process.returncode} before it said {says!r}:\n{text()}")
                if time.monotonic() > end:
                    raise Wrong(f"does not say {says!r}:\n{text()}")
                time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            try:
                code = process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                raise Wrong(f"does not end by SIGINT:\n{text()}") from None
            if code != 0:
                raise Wrong(f"exit code {code} after SIGINT:\n{text()}")
        finally:
            kill(process)


def screen(command: str, place: Path, environment: dict[str, str], says: str) -> None:
    """Starts a program in a terminal of 120 × 40, waits for a text on its screen, and ends it by the key `q`."""
    host, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    process = subprocess.Popen(
        ["bash", "-c", f"exec {command}"], cwd=place, env=environment | {"TERM": "xterm"},
        stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
    )  # fmt: skip
    os.close(terminal)
    shown, asked, end = b"", False, time.monotonic() + PATIENCE
    try:
        while process.poll() is None:
            if time.monotonic() > end:
                raise Wrong(f"does not {'end by q' if asked else f'show {says!r}'}:\n{shown.decode(errors='replace')}")
            if not select.select([host], [], [], 0.1)[0]:
                continue
            try:
                shown += os.read(host, 65536)
            except OSError:
                # The program has closed the terminal.
                process.wait(PATIENCE)
                break
            if not asked and says.encode() in shown:
                os.write(host, b"q")
                asked = True
        if not asked:
            raise Wrong(f"ended without {says!r}:\n{shown.decode(errors='replace')}")
        if process.returncode != 0:
            raise Wrong(f"exit code {process.returncode} after q:\n{shown.decode(errors='replace')}")
    finally:
        kill(process)
        os.close(host)
