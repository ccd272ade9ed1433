"""What the checks of wstac-node share: programs, sessions of Zenoh, listeners, a router and a board."""

import contextlib
import fcntl
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import traceback
from pathlib import Path

import zenoh

SCENE = "lead_in = 30\ngap = 70\nseed = {seed}\n" + "".join(
    f'[[slide]]\nspecimen = "{specimen}"\nspeed = {speed}\ndirection = {direction}\n'
    for specimen, speed, direction in (("Saw3", 150, 90), ("Sin2", 170, 180), ("Tri4", 130, 300))
)
# No message takes longer than this on a loaded machine.
PATIENCE = 60


def fail(message):
    sys.exit(f"{Path(sys.argv[0]).name}: {message}")


def same(found, expected, what):
    if found != expected:
        fail(f"{what}: {found!r:.2000}, expected {expected!r:.2000}")


def near(found, expected, most, what):
    if not abs(found - expected) <= most:
        fail(f"{what}: {found}, expected {expected} within {most}")


def until(is_so, what, seconds=PATIENCE):
    """Waits until something is so."""
    end = time.monotonic() + seconds
    while not is_so():
        if time.monotonic() > end:
            fail(f"after {seconds} s still not: {what}")
        time.sleep(0.02)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def config_of(mode, **endpoints):
    """Returns the settings of a session of Zenoh that looks for nobody."""
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    for key, endpoint in endpoints.items():
        config.insert_json5(f"{key}/endpoints", json.dumps([endpoint]))
    return config


def session(mode, **endpoints):
    """Opens a session. Tries again if it is refused."""
    config = config_of(mode, **endpoints)
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


class Listener:
    """Keeps what arrives, by key."""

    def __init__(self, endpoint, keys="wstac/**", raw=False):
        self.raw = raw
        self.messages, self.lock = {}, threading.Lock()
        self.session = session("client", connect=endpoint)
        self.subscriber = self.session.declare_subscriber(keys, self.take)
        # The other side answers in the order of what it is told: when it has answered, it knows the subscriber.
        list(self.session.liveliness().get("wstac/*", timeout=PATIENCE))

    def take(self, sample):
        attachment = sample.attachment and (sample.attachment.to_bytes() if self.raw else sample.attachment.to_string())
        with self.lock:
            arrived = self.messages.setdefault(str(sample.key_expr), [])
            arrived.append((sample.payload.to_bytes(), attachment, str(sample.encoding)))

    def lines(self, key):
        """Returns the objects that have arrived under a key."""
        with self.lock:
            return [json.loads(payload) for payload, *_ in self.messages.get(key, [])]

    def kept_events(self, sensor):
        """Returns the events that the node keeps, by their keys."""
        replies = self.session.get(f"wstac/{sensor}/event/*", timeout=PATIENCE)
        return {str(reply.ok.key_expr): json.loads(reply.ok.payload.to_bytes()) for reply in replies}

    def close(self):
        self.session.close()


class Programs:
    page = Path(__file__).parents[2] / "docs" / "NETWORK.md"

    def __init__(self, wstac, node, folder):
        self.wstac, self.command, self.folder = wstac, node, folder

    def scene(self, name, seed):
        file = self.folder / f"{name}.toml"
        file.write_text(SCENE.format(seed=seed))
        return f"scene:{file}"

    def run(self, source, *options):
        """Returns what `wstac run` prints; without a model, as the node has none by itself."""
        command = [self.wstac, "run", source, "--json", "--features", "--motion", *(options or ("--model", "none"))]
        done = subprocess.run(command, capture_output=True, check=True, text=True, timeout=PATIENCE)
        return [json.loads(line) for line in done.stdout.splitlines()]

    @contextlib.contextmanager
    def node(self, *arguments):
        """Starts the node, whose command may have several words. It is killed at the end if it still runs. `said` has its notes."""
        notes = tempfile.TemporaryFile("w+")
        command = self.command if isinstance(self.command, list) else [self.command]
        with subprocess.Popen([*command, *map(str, arguments)], stderr=notes, stdin=subprocess.DEVNULL) as node:

            def said():
                notes.seek(0)
                return notes.read()

            node.said = said
            try:
                until(lambda: "keys begin with" in said() or node.poll() is not None, "the node is ready")
                yield node
            finally:
                node.kill()


def sockets(node):
    """Returns the sockets at which the node listens: protocol and address."""
    listening = subprocess.run(["ss", "-Hlnptu"], capture_output=True, check=True, text=True).stdout
    return [(line.split()[0], line.split()[4]) for line in listening.splitlines() if f"pid={node.pid}," in line]


def of_kind(records, kind):
    return [record for record in records if record["kind"] == kind]


def timeless(records):
    """Returns records of a board without their times, which are those of its own clock."""
    times = ("time_ns", "completed_ns", "time_s", "completed_s", "clock")
    return [{name: value for name, value in record.items() if name not in times} for record in records]


def router(port):
    """Starts a router of Zenoh in a process of its own."""
    program = (
        "import json, sys, time, zenoh; c = zenoh.Config(); c.insert_json5('mode', '\"router\"');"
        "c.insert_json5('scouting/multicast/enabled', 'false');"
        "c.insert_json5('listen/endpoints', json.dumps([sys.argv[1]])); s = zenoh.open(c); time.sleep(1e6)"
    )
    return subprocess.Popen([sys.executable, "-c", program, f"tcp/127.0.0.1:{port}"])


class BoardPeer:
    """Plays boards: one behind TCP and one behind a serial line, which is unplugged in the middle."""

    def __init__(self, programs, scene):
        command = [programs.command.parent / "examples" / "board_bytes", scene]
        self.sent = subprocess.run(command, capture_output=True, check=True, timeout=PATIENCE).stdout
        self.tcp = socket.create_server(("127.0.0.1", 0))
        self.device = programs.folder / "ttyBoard"
        self.plug()

    def plug(self):
        self.serial, host = os.openpty()
        new = self.device.with_suffix(".new")
        new.symlink_to(os.ttyname(host))
        new.rename(self.device)
        self.host = host

    def unread(self):
        """Returns the number of bytes on the serial line that nobody has read."""
        return struct.unpack("i", fcntl.ioctl(self.host, termios.FIONREAD, bytes(4)))[0]

    def unplug(self):
        # What a busy machine has not read yet would be lost with the line.
        until(lambda: self.unread() == 0, "everything on the serial line is read")
        os.close(self.serial), os.close(self.host)

    def play(self, write, part=slice(None), seconds=3):
        """Sends a part of all bytes within some seconds."""
        data = self.sent[part]
        step = max(1, len(data) // 100)
        for start in range(0, len(data), step):
            write(data[start : start + step])
            time.sleep(seconds / 100)


def run_main(main):
    """Runs a check. One that fails ends the process at once: sessions that are still open would keep it."""
    try:
        main()
    except BaseException as error:
        print(error if isinstance(error, SystemExit) else traceback.format_exc(), file=sys.stderr, flush=True)
        os._exit(1)
