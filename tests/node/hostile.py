"""Checks what strangers can do to wstac-node: connections that say nothing, and clients that ask and read nothing."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time

import zenoh

from common import PATIENCE, config_of, fail, free_port, same, until
from ros import DOMAIN, Client

# Whoever asks a service waits no longer, whatever others do.
MOST_SECONDS = 1
# The files that the node may open: fewer than there are connections.
FILES = 400
SESSIONS = 128
# It connects without a word, as often as it can, and keeps 250 connections open.
SILENT = """
import contextlib, os, socket, sys
os.nice(10)
kept = []
while True:
    with contextlib.suppress(OSError):
        kept.append(socket.create_connection(('127.0.0.1', int(sys.argv[1])), timeout=0.5))
    if len(kept) > 250:
        kept.pop(0).close()
"""
# It asks for all kept events, and has little room for answers.
HOG = """
import json, sys, time, zenoh
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
def several(count, program, argument):
    """Runs a program several times at once."""
    running = [subprocess.Popen([sys.executable, "-c", program, str(argument)]) for _ in range(count)]
    try:
        yield running
    finally:
        [one.kill() or one.wait() for one in running]


def answered(client, seconds):
    """Calls services for some seconds: a parameter, and a recording that begins and ends. Returns the longest wait."""
    worst, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        for service, fields in (
            ("/wstac_node/get_parameters", {"names": ["left.source"]}),
            ("/wstac/left/start_recording", {"features_only": True}),
            ("/wstac/left/stop_recording", {}),
        ):
            before = time.monotonic()
            answer = client.call(service, **fields)
            worst = max(worst, time.monotonic() - before)
            if not getattr(answer, "success", True):
                fail(f"{service}: {answer.message!r}")
        time.sleep(0.05)
    if worst > MOST_SECONDS:
        fail(f"a service took {worst:.2f} s, expected at most {MOST_SECONDS} s")
    return worst


def check_hostile(programs):
    """Silent connections use up no files, sessions have a bound, and clients that read nothing delay no service."""
    port, folder, scene = free_port(), programs.folder / "hostile", programs.folder / "hostile.toml"
    endpoint = f"tcp/127.0.0.1:{port}"
    folder.mkdir()
    slides = '[[slide]]\nspecimen = "Saw3"\nspeed = 150\ndirection = 90\n' * 100
    scene.write_text(f'lead_in = 30\ngap = 30\nseed = 1\nfidelity = "taxel"\n{slides}')
    arguments = ("--ros", "--zenoh", "--domain", DOMAIN, "--files", folder, "--listen", f"{endpoint}#so_sndbuf=8192")
    with programs.node(f"left=scene:{scene}", *arguments) as node:
        resource.prlimit(node.pid, resource.RLIMIT_NOFILE, (FILES, FILES))
        client = Client(endpoint, DOMAIN)

        def files():
            return len(os.listdir(f"/proc/{node.pid}/fd"))

        before = files()
        with several(4, SILENT, port):
            time.sleep(1)
            flooded = answered(client, 4)
        until(lambda: files() <= before, "the files of silent connections are closed")
        same("Too many open files" in node.said(), False, f"files that are used up: {node.said()!r}")

        with several(10, HOG, endpoint) as hogs:
            until(lambda: files() >= before + len(hogs), "clients that ask")
            time.sleep(1)
            [hog.send_signal(signal.SIGSTOP) for hog in hogs]
            stalled = answered(client, 4)
            until(lambda: files() <= before, "clients that take nothing are cut off")
        client.close()

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
        f"silent connections by the thousand and {FILES} files: answers within {flooded:.2f} s; "
        f"{len(hogs)} clients that read nothing: within {stalled:.2f} s; {SESSIONS} clients at once"
    )
