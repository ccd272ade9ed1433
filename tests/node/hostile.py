"""Checks what strangers can do to wstac-node: connections that say nothing, and clients that ask and read nothing."""

import contextlib
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import zenoh

from common import PATIENCE, Listener, config_of, free_port, same, until

# Features come 30 times per second on an idle machine, whatever others do. A busy one may be late.
MOST_SECONDS = 5
# Sessions at once. Twice as many connections may wait for a handshake or for their end.
SESSIONS = 128
# It connects without a word, after pauses of so many seconds, and keeps 250 connections open.
SILENT = """
import contextlib, os, socket, sys, time
os.nice(10)
kept = []
while True:
    with contextlib.suppress(OSError):
        kept.append(socket.create_connection(('127.0.0.1', int(sys.argv[1])), timeout=0.5))
    if len(kept) > 250:
        kept.pop(0).close()
    time.sleep(float(sys.argv[2]))
"""
# It asks for all kept events, and has little room for answers.
HOG = """
import json, os, sys, time, zenoh
os.nice(10)
c = zenoh.Config()
c.insert_json5('mode', '"client"'); c.insert_json5('scouting/multicast/enabled', 'false')
c.insert_json5('connect/endpoints', json.dumps([sys.argv[1] + '#so_rcvbuf=4096']))
s = zenoh.open(c)
while True:
    for key in ('wstac/**', 'wstac/left/event/*'):
        s.get(key, lambda reply: None, timeout=60)
    time.sleep(0.002)
"""


@contextlib.contextmanager
def several(count, program, *arguments):
    """Runs a program several times at once. What is called ends the oldest, stops all others, and starts a new one, once a second."""

    def start():
        return subprocess.Popen([sys.executable, "-c", program, *map(str, arguments)])

    running, renewed = [start() for _ in range(count)], [0.0]

    def renew():
        if time.monotonic() < renewed[0] + 1:
            return
        renewed[0] = time.monotonic()
        oldest = running.pop(0)
        oldest.kill() or oldest.wait()
        [one.send_signal(signal.SIGSTOP) for one in running]
        running.append(start())

    try:
        yield renew
    finally:
        [one.kill() or one.wait() for one in running]


def heard(listener, seconds, look=lambda: None):
    """Hears features for some seconds, and looks at something meanwhile. Returns the longest time without one."""

    def count():
        return len(listener.messages.get("wstac/left/features", ()))

    worst, end, before, last = 0, time.monotonic() + seconds, count(), time.monotonic()
    while time.monotonic() < end:
        look()
        time.sleep(0.01)
        if count() > before:
            before, last = count(), time.monotonic()
        worst = max(worst, time.monotonic() - last)
        same(worst < MOST_SECONDS, True, f"{worst:.2f} s without features are less than {MOST_SECONDS} s")
    return worst


def silent(port):
    """Connects without a word. Returns the time until the node closes the connection."""
    begun = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as stranger, contextlib.suppress(ConnectionResetError):
        same(stranger.recv(1), b"", "what is said to a silent connection")
    return time.monotonic() - begun


def check_hostile(programs):
    """Silent connections go and are few, sessions have a bound, and clients that read nothing hold up no subscriber."""
    port, scene = free_port(), programs.folder / "hostile.toml"
    endpoint = f"tcp/127.0.0.1:{port}"
    slides = '[[slide]]\nspecimen = "Saw3"\nspeed = 150\ndirection = 90\n' * 400
    scene.write_text(f'lead_in = 30\ngap = 30\nseed = 1\nfidelity = "taxel"\n{slides}')
    with programs.node(f"left=scene:{scene}", "--listen", f"{endpoint}#so_sndbuf=8192") as node:
        listener = Listener(endpoint, "wstac/left/features")

        def connections():
            """Counts the sockets. The other files are of Zenoh's threads, some of which begin late."""
            files, count = Path(f"/proc/{node.pid}/fd"), 0
            for file in files.iterdir():
                # It may have been closed meanwhile.
                with contextlib.suppress(FileNotFoundError):
                    count += file.readlink().name.startswith("socket:")
            return count

        before, gone = connections(), silent(port)
        few = len(os.listdir(f"/proc/{node.pid}/fd")) + SESSIONS - 8
        peaks, most = [], before + 3 * SESSIONS
        with several(4, SILENT, port, 0):
            until(lambda: connections() > before + SESSIONS // 2, "silent connections")
            flooded = heard(listener, 4, lambda: peaks.append(connections()))
            # A node that gets no processor closes some late. Without an end for the silent ones there are a thousand all the time.
            for _ in range(3):
                until(lambda: connections() <= most, f"at most {most} sockets under silent connections")
                time.sleep(0.1)
        with several(4, SILENT, port, 0.004):
            until(lambda: connections() > before + SESSIONS // 2, "silent connections")
            begun, admitted = time.monotonic(), 0
            for _ in range(20):
                with contextlib.suppress(zenoh.ZError):
                    zenoh.open(config_of("client", connect=endpoint)).close()
                    admitted += 1
            let_in = (time.monotonic() - begun) / 20
            # Without the node's help, one of eight.
            same((admitted >= 10, let_in < PATIENCE), (True, True), f"{admitted} of 20 new clients, each after {let_in:.2f} s")
            # So few files that all are open: whoever says nothing goes before its time.
            usual = resource.prlimit(node.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(node.pid, resource.RLIMIT_NOFILE, (few, usual[1]))
            cut = min(silent(port) for _ in range(5))
            resource.prlimit(node.pid, resource.RLIMIT_NOFILE, usual)
            same(cut < gone / 2, True, f"{cut:.1f} s until a silent connection goes while all files are open are less than half of {gone:.1f} s")
        until(lambda: connections() <= before, "silent connections are closed")

        with several(10, HOG, endpoint) as renew:
            until(lambda: connections() >= before + 10, "clients that ask")
            asking = heard(listener, 4)
            renewed = heard(listener, 10, renew)
            # All but the new one are alive, and take nothing.
            until(lambda: connections() <= before + 1, "clients that take nothing are cut off")
        until(lambda: connections() <= before, "clients that are killed are gone")
        listener.close()

        config = config_of("client", connect=endpoint)
        sessions = []
        with contextlib.suppress(zenoh.ZError):
            while len(sessions) <= SESSIONS:
                sessions.append(zenoh.open(config))
        same(len(sessions), SESSIONS, "clients at once")
        [one.close() for one in sessions]
        node.send_signal(signal.SIGINT)
        same(node.wait(PATIENCE), 0, "exit code")
    print(
        f"silent connections go after {gone:.1f} s; under thousands of them {max(peaks) - before} more sockets, features at the latest after {flooded:.2f} s, under 1000 each second {admitted} of 20 new clients, after {let_in:.2f} s each; "
        f"10 clients that ask: within {asking:.2f} s, that take nothing and are renewed: {renewed:.2f} s; {SESSIONS} clients at once"
    )
