"""Tests the live link: an emulated board's UART on a socket, and `wstac monitor` at its other end, which requests its
outputs.
"""

import concurrent.futures
import json
import socket
import subprocess
import sys
import time

import boards

# The frames of a sample behind which the requests are too late for it, with some for the later ones of them.
LATE = 40
# The requests that `wstac monitor` sends at the start, each with a zero byte at its end.
REQUESTS = 4
# Fields that are times.
TIMES = ("time_ns", "completed_ns", "time_s", "completed_s", "stamp", "stamp_within_ms", "clock")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def pass_on(source, sink):
    """Passes bytes on until the source ends."""
    try:
        while part := source.recv(4096):
            sink.sendall(part)
        sink.shutdown(socket.SHUT_WR)
    except OSError:
        # The other end is gone, and the command ends.
        pass


def connected(port, qemu):
    """Returns a connection to the UART of a board, which waits for it; `None` if the board has ended."""
    while qemu.poll() is None:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            time.sleep(0.01)
    return None


def monitored(board, elf, folder, wstac, what):
    """Runs the board with `wstac monitor` at the other end of its UART. Returns the finished command."""
    port = free_port()
    command = boards.command(board, elf, f"tcp:127.0.0.1:{port},server=on,wait=on")
    with socket.create_server(("127.0.0.1", 0)) as server, concurrent.futures.ThreadPoolExecutor() as pool:
        asked = [wstac, "monitor", "tcp:127.0.0.1:{}".format(server.getsockname()[1]), "--json", "--features", what]
        done = pool.submit(subprocess.run, asked, capture_output=True, text=True, timeout=600, check=False)
        server.settimeout(600)
        host, _ = server.accept()
        # The board starts when its requests are there: then they are on time, however busy the machine is.
        requests = b""
        while requests.count(b"\0") < REQUESTS and (part := host.recv(4096)):
            requests += part
        qemu = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            with host:
                if uart := connected(port, qemu):
                    with uart:
                        uart.settimeout(600)
                        uart.sendall(requests)
                        pool.submit(pass_on, host, uart)
                        pass_on(uart, host)
            return done.result()
        finally:
            qemu.kill()
            qemu.wait()


def is_late(got, expected):
    """Returns whether the first frame with features is too far into the sample of the first event, the request for motion came
    after the first motion, or the board's first frames came before the host was there, so that it counts fewer.
    """
    first = lambda lines, kind, key="frame": next((line[key] for line in map(json.loads, lines) if line["kind"] == kind), None)
    begins, event = first(got, "features"), first(expected, "event")
    if first(got, "motion") != first(expected, "motion"):
        return True
    is_short = first(got, "end", "frames") != first(expected, "end", "frames")
    return is_short or begins is None or event is not None and begins >= event + LATE


def timeless(line):
    """Returns a record without its times. Over a live link they are those of the board's clock, which runs by itself."""
    return {name: value for name, value in json.loads(line).items() if name not in TIMES}


def check(board, elf, folder, wstac, expected, what="--samples"):
    """Compares the output with the lines of `wstac run --json --features` on the same frames, with samples or with motion."""
    # The emulated board is faster than a real one. On a busy machine the requests may reach it behind the first event.
    for _ in range(5):
        done = monitored(board, elf, folder, wstac, what)
        if done.returncode:
            sys.exit(f"{board.core}: wstac monitor failed ({done.returncode}): {done.stderr.strip()}")
        got = done.stdout.splitlines()
        if not is_late(got, expected):
            break
        print(f"{board.core}: the requests came too late; again")
    got, expected = [timeless(line) for line in got], [timeless(line) for line in expected]
    got_features = [record for record in got if record["kind"] == "features"]
    got_others = [record for record in got if record["kind"] != "features"]
    want_others = [record for record in expected if record["kind"] != "features"]
    if got_others != want_others:
        apart = next((pair for pair in zip(got_others, want_others) if pair[0] != pair[1]), (len(got_others), len(want_others)))
        apart = " for ".join(str(one)[:300] for one in apart)
        sys.exit(f"{board.core}: events over the live link are not the host's: {apart}: {done.stderr.strip()}")
    # The request takes some time to arrive. After that, the features of every frame are there.
    want_features = [record for record in expected if record["kind"] == "features"]
    if not got_features or got_features != want_features[-len(got_features) :]:
        sys.exit(f"{board.core}: features over the live link are not the host's: {len(got_features)} of them")
    return f"over its UART live: {len(got) - len(got_features)} records with {what[2:]}, features of {len(got_features)} frames"
