#!/usr/bin/env python3
"""Checks wstac-node with Zenoh's own client for Python, and with rosbags, which reads the messages of ROS 2: what arrives
is what `wstac run` prints.

    check.py WSTAC NODE [CHECK...]    the two programs; the checks to run, such as config, or else all
"""

import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from pathlib import Path

import zenoh

from common import PATIENCE, BoardPeer, Listener, Programs, fail, free_port, near, of_kind, router, run_main, same, session, sockets, timeless, until
from hostile import check_hostile
from ros import check_cdr
from tls import check_tls


def check_messages(programs):
    """Two sensors: every record of `wstac run` arrives, in its order, and a late reader gets the events."""
    sources = {name: programs.scene(name, seed) for name, seed in (("left", 1), ("right", 2))}
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with programs.node(*(f"{name}={source}" for name, source in sources.items()), "--listen", endpoint) as node:
        listener = Listener(endpoint)
        alive = [str(reply.ok.key_expr) for reply in listener.session.liveliness().get("wstac/*", timeout=PATIENCE)]
        same(sorted(alive), ["wstac/left", "wstac/right"], "tokens of liveliness")
        same(sockets(node), [("tcp", endpoint.removeprefix("tcp/"))], "sockets of the node")
        until(lambda: all(len(listener.lines(f"wstac/{name}/event")) >= 2 for name in sources), "two events of each sensor")
        late = Listener(endpoint)
        kept = {name: late.kept_events(name) for name in sources}
        same(node.wait(PATIENCE), 0, "exit code")
        until(lambda: all(listener.lines(f"wstac/{name}/end") for name in sources), "the ends")
    count = 0
    for name, source in sources.items():
        expected = programs.run(source)
        first = listener.lines(f"wstac/{name}/features")[0]["frame"]
        for kind in ("features", "motion", "event", "contact_end", "end"):
            # What was published before the listener came is not heard.
            wanted = [record for record in of_kind(expected, kind) if record.get("frame", first) >= first or kind != "features"]
            found = of_kind(listener.lines(f"wstac/{name}/{kind}"), kind)
            same(found, wanted, f"{kind} of {name}")
            count += len(found)
        taxels = listener.lines(f"wstac/{name}/taxels")
        frames = [record["frame"] for record in listener.lines(f"wstac/{name}/features")]
        same([record["frame"] for record in taxels][-len(frames) :], frames[-len(taxels) :], f"frames with taxels of {name}")
        same({len(record["sums"]) for record in taxels}, {25}, "taxels")
        times = {record["frame"]: record["time_ns"] for record in listener.lines(f"wstac/{name}/features")}
        same([record["time_ns"] for record in taxels if record["frame"] in times], [times[record["frame"]] for record in taxels if record["frame"] in times], f"times of taxels of {name}")
        state = listener.lines(f"wstac/{name}/state")
        same((state[-1]["frames"], state[-1]["events"], state[-1]["skipped"]), (expected[-1]["frames"], 3, 0), f"the last state of {name}")
        same(state[-1]["time_ns"], max(times.values()), f"time of the last state of {name}")
        same((state[-1]["readout_ms"], "note" in state[-1]), (0.0, False), f"what is stated of {name}")
        same([part[1:] for part in listener.messages[f"wstac/{name}/event"]], [(str(k), "application/json") for k in range(3)], "event numbers")
        events = of_kind(expected, "event")
        for key, event in kept[name].items():
            same(of_kind([event], "event")[0], events[int(key.rsplit("/", 1)[1])], f"{key} for a late reader")
        same(len(kept[name]) >= 2, True, "events for a late reader")
    listener.close(), late.close()
    print(f"two sensors: {count} records as wstac run, with taxels and state; a late reader gets the events; one socket, at 127.0.0.1")


def check_router(programs):
    """A router that comes late, is killed and comes back: the sensor goes on, and no event is lost for who asks."""
    port, source = free_port(), programs.scene("sensor", 3)
    expected = programs.run(source)
    with programs.node(source, "--connect", f"tcp/127.0.0.1:{port}") as node:
        until(lambda: f"not connected to tcp/127.0.0.1:{port} yet" in node.said(), "that nobody hears the node")
        first = router(port)
        try:
            until(lambda: f"connected to tcp/127.0.0.1:{port}\n" in node.said(), "that the router is there")
            listener = Listener(f"tcp/127.0.0.1:{port}")
            until(lambda: len(listener.lines("wstac/sensor/features")) > 10, "features through a router that came late")
        finally:
            first.kill(), first.wait()
        second = router(port)
        try:
            before = len(listener.lines("wstac/sensor/features"))
            until(lambda: len(listener.lines("wstac/sensor/features")) > before + 10, "features through the router that came back")
            until(lambda: [state for state in listener.lines("wstac/sensor/state") if state["events"] == 3], "three events")
            kept = [event for _, event in sorted(listener.kept_events("sensor").items())]
            same(node.wait(PATIENCE), 0, "exit code")
            until(lambda: listener.lines("wstac/sensor/end"), "the end")
            same(of_kind(kept, "event"), of_kind(expected, "event"), "events for who asks")
            same(listener.lines("wstac/sensor/end"), of_kind(expected, "end"), "the end")
        finally:
            listener.close()
            second.kill(), second.wait()
    print("a router that came late, was killed and came back: features go on, and all 3 events are there for who asks")


STALLED = """
import json, os, signal, sys, zenoh
c = zenoh.Config()
c.insert_json5('mode', '"client"'); c.insert_json5('scouting/multicast/enabled', 'false')
c.insert_json5('connect/endpoints', json.dumps([sys.argv[1]]))
s = zenoh.open(c)
def stop(sample):
    os.kill(os.getpid(), signal.SIGSTOP)
k = s.declare_subscriber('wstac/**', stop)
signal.pause()
"""


def check_strangers(programs):
    """A subscriber that stops reading, bytes that are no protocol, and large messages under a sensor's keys."""
    source, endpoint = programs.scene("sensor", 4), f"tcp/127.0.0.1:{free_port()}"
    expected = programs.run(source)
    begun = time.monotonic()
    with programs.node(source, "--listen", endpoint) as node:
        listener = Listener(endpoint)
        stalled = subprocess.Popen([sys.executable, "-c", STALLED, endpoint])
        try:
            with socket.create_connection(("127.0.0.1", int(endpoint.rsplit(":", 1)[1]))) as stranger:
                stranger.sendall(os.urandom(100_000))
            rogue = session("client", connect=endpoint)
            rogue.put("wstac/sensor/state", bytes(20_000_000))
            rogue.put("wstac/sensor/event/0", b"{")
            until(lambda: listener.lines("wstac/sensor/features"), "features")
            rogue.close()
            same(node.wait(PATIENCE), 0, "exit code")
            took = time.monotonic() - begun
            stops = Path(f"/proc/{stalled.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
            same(stops, "T", "the state of the subscriber that stops reading")
            until(lambda: listener.lines("wstac/sensor/end"), "the end")
        finally:
            stalled.kill(), stalled.wait()
    for kind in ("event", "contact_end", "end"):
        same(of_kind(listener.lines(f"wstac/sensor/{kind}"), kind), of_kind(expected, kind), kind)
    # The sensor did not wait: it read every frame in time, and left nothing out.
    state = [json.loads(payload) for payload, *_ in listener.messages["wstac/sensor/state"] if len(payload) < 1000][-1]
    frames = expected[-1]["frames"]
    same((state["frames"], state["skipped"], state["dropped"]), (frames, 0, 0), "the last state")
    same(took < frames / 30 + 10, True, f"{frames} frames in {took:.1f} s")
    listener.close()
    print("a subscriber that stops, bytes that are no protocol, 20 MB under a key: no sensor waits, and all events arrive")


def check_arguments(programs):
    """Wrong arguments, an address in use, and a signal."""
    port = free_port()
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        for arguments, code, text in (
            ([], 2, "required arguments"),
            (["scene:Saw3@150", "--listen", f"tcp/127.0.0.1:{port}"], 2, f"127.0.0.1:{port}"),
            (["scene:Saw3@150", "--connect", "udp/127.0.0.1:1"], 2, '--connect is "udp/127.0.0.1:1": expected tcp/ADDRESS:PORT'),
            (["scene:Saw3@150,60mm", "--connect", f"tcp/127.0.0.1:{free_port()}"], 0, "was never connected to tcp/127.0.0.1:"),
            (["scene:Saw3\x1b[31m@\u202e150"], 2, "\\u001b[31m@\\u202e150"),
            # Names of files need not be UTF-8.
            ([b"\xff"], 1, '"\ufffd": no such file'),
        ):
            done = subprocess.run([programs.command, *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False)
            same(done.returncode, code, f"exit code of {arguments}, which says {done.stderr!r}")
            if text not in done.stderr or "\x1b" in done.stderr or "\u202e" in done.stderr:
                fail(f"{arguments}: {done.stderr!r}, expected {text!r}")
            if re.search(r"\.rs\b|\.cargo", done.stderr):
                fail(f"{arguments}: {done.stderr!r}, expected no place in source code")
    with programs.node(programs.scene("sensor", 5), "--listen", f"tcp/127.0.0.1:{port}") as node:
        listener = Listener(f"tcp/127.0.0.1:{port}")
        until(lambda: listener.lines("wstac/sensor/features"), "features")
        node.send_signal(signal.SIGINT)
        same(node.wait(PATIENCE), 0, "exit code after SIGINT")
        until(lambda: listener.lines("wstac/sensor/end"), "the end after SIGINT")
        same(re.findall(r"ended by a signal|error|panick", node.said()), ["ended by a signal"], "notes after SIGINT")
        listener.close()
    print("wrong arguments, an address in use, and a signal: told")


# A decoder of videos that gives a frame, says that this was all, and does not end.
DECODER = """#!/bin/sh
printf 'YUV4MPEG2 W400 H400 F30:1 Cmono\\nFRAME\\n'
head -c 160000 /dev/zero
exec sleep 60 >&-
"""
PROBE = "#!/bin/sh\necho pix_fmt=gray\necho avg_frame_rate=30/1\n"


def check_hang(programs):
    """Sensors that wait forever for their source: a signal ends the node, which says for which."""
    folder, video, other = programs.folder / "bin", programs.folder / "clip.mp4", programs.scene("sensor", 5)
    folder.mkdir()
    video.write_bytes(b"a video")
    for name, text in (("ffmpeg", DECODER), ("ffprobe", PROBE)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    before, endpoint = os.environ["PATH"], f"tcp/127.0.0.1:{free_port()}"
    os.environ["PATH"] = f"{folder}:{before}"
    stuck = [f"stuck{number}" for number in range(5)]
    try:
        with programs.node(*(f"{name}={video}" for name in stuck), f"other={other}", "--listen", endpoint) as node:
            listener = Listener(endpoint)
            # A second later it waits for its decoder.
            for name in stuck:
                until(lambda name=name: [state["frames"] for state in listener.lines(f"wstac/{name}/state")].count(1) > 1, "the only frame")
            begun = time.monotonic()
            node.send_signal(signal.SIGTERM)
            until(lambda: listener.lines("wstac/other/end"), "the end of the other sensor")
            same(node.wait(PATIENCE), 1, "exit code of a node with a sensor that does not end")
            same(time.monotonic() - begun > 9, True, f"{time.monotonic() - begun:.1f} s from the signal to the end")
            found = re.fullmatch(r"(?s).*ended by a signal; after 10 s it no longer waits for the sensors: (.*)\n", node.said())
            same(found and sorted(found[1].split(", ")), stuck, f"sensors that do not end, of {node.said()!r}")
            listener.close()
    finally:
        os.environ["PATH"] = before
    print("sensors that wait forever: SIGTERM ends the node after 10 s")


def check_several(programs):
    """A recording of several sensors: all are published by their names, or those that are named."""
    both = programs.folder / "both.mcap"
    sources = {name: programs.scene(name, seed) for name, seed in (("left", 1), ("right", 2))}
    command = [programs.wstac, "record", *(f"cam:{name}={source}" for name, source in sources.items()), "--features-only", "-o", both]
    subprocess.run(command, capture_output=True, check=True, timeout=PATIENCE)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    for given, names in (([both], ["left", "right"]), ([f"right={both}"], ["right"])):
        with programs.node(*given, "--listen", endpoint) as node:
            listener = Listener(endpoint)
            alive = [str(reply.ok.key_expr) for reply in listener.session.liveliness().get("wstac/*", timeout=PATIENCE)]
            same(sorted(alive), [f"wstac/{name}" for name in names], f"sensors of {given}")
            same(node.wait(PATIENCE), 0, "exit code")
            until(lambda: all(listener.lines(f"wstac/{name}/end") for name in names), "the ends")
        for name in names:
            expected = of_kind(programs.run(sources[name]), "event")
            same(of_kind(listener.lines(f"wstac/{name}/event"), "event"), expected, f"events of {name} of {given}")
        listener.close()
    for given, part in (
        ([f"thumb={both}"], "has no sensor thumb, expected one of left, right before ="),
        ([both, "right=scene:Saw3@150"], "the name right is taken"),
        ([both, "scene:Saw3@150"], "several sources need names"),
    ):
        done = subprocess.run([programs.command, *map(str, given)], capture_output=True, text=True, timeout=PATIENCE, check=False)
        same((done.returncode, part in done.stderr, "--sensor" in done.stderr), (2, True, False), f"{given}: {done.stderr!r}")
    print("a recording of several sensors: all are published, or one of them")


def check_rates(programs):
    """Of frames that are added up, taxels are the sums that features are made of, once for each feature frame."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    for fps, added in ((30, 1), (60, 2), (120, 4)):
        scene = programs.folder / f"fps-{fps}.toml"
        slide = '[[slide]]\nspecimen = "Saw3"\nspeed = 150\ndirection = 90\n'
        scene.write_text(f'lead_in = {30 * added}\ngap = {60 * added}\nseed = 2\nfidelity = "taxel"\n[sensor]\nfps = {fps}\n{slide}')
        with programs.node(f"scene:{scene}", "--listen", endpoint) as node:
            listener = Listener(endpoint)
            same(node.wait(PATIENCE), 0, "exit code")
            until(lambda: listener.lines("wstac/sensor/end"), "the end")
        features = {record["frame"]: record for record in listener.lines("wstac/sensor/features")}
        frames = [record["frame"] for record in listener.lines("wstac/sensor/taxels")]
        listener.close()
        # Those on both sides of the connection's begin are left out.
        same(frames[1:], list(features)[-len(frames) :][1:], f"frames of taxels at {fps} frames per second")
        same(len(frames) > 100, True, f"{len(frames)} taxels at {fps} frames per second")
        # f = ln R - ln(G A): what is left of f and the sums is the same everywhere but in the dark.
        left, dark = [], min(min(record["f"]) for record in features.values())
        for record in listener.lines("wstac/sensor/taxels")[1:]:
            rows = [record["sums"][5 * k : 5 * k + 5] for k in range(5)]
            lines = [sum(row) for row in rows] + [sum(column) for column in zip(*rows, strict=True)]
            lit = [(f, line) for f, line in zip(features[record["frame"]]["f"], lines, strict=True) if f > dark + 0.1]
            left += [f - math.log(line) for f, line in lit]
        same(len(left) > 200, True, f"{len(left)} lit rows and columns")
        near(max(left), min(left), 0.002, f"features and the sums they are made of, at {fps} frames per second")
    print("taxels at 30, 60 and 120 frames per second: the sums that the features of this frame are made of")


def check_boards(programs):
    """Boards behind TCP and a serial line: their records are those of `wstac run` of the same frames."""
    scene, endpoint = programs.scene("board", 8), f"tcp/127.0.0.1:{free_port()}"
    # This board waits for 70 frames, as `wstac run` does for samples.
    expected, peer = programs.run(scene, "--model", "none", "--samples"), BoardPeer(programs, scene)
    left, right = f"left=tcp:127.0.0.1:{peer.tcp.getsockname()[1]}", f"right={peer.device}"
    with programs.node(left, right, "--baud", 230400, "--listen", endpoint) as node:
        listener = Listener(endpoint)
        same([line for line in ("left: a board at tcp:", "right: a board at ") if line not in node.said()], [], "notes")
        connection, _ = peer.tcp.accept()
        over_tcp = threading.Thread(target=peer.play, args=(connection.sendall,))
        over_tcp.start()
        # The requests come first: they ask for a description, features and motion.
        same(connection.recv(4096) != b"" and os.read(peer.serial, 4096) != b"", True, "requests to the boards")
        half = len(peer.sent) // 2
        peer.play(lambda data: os.write(peer.serial, data), slice(None, half))
        until(lambda: len(listener.lines("wstac/right/features")) > 20, "features of the board on the serial line")
        peer.unplug()
        until(lambda: "is gone; waiting for it" in node.said(), "the note that the device is gone")
        peer.plug()
        until(lambda: "is back" in node.said(), "the note that the device is back")
        peer.play(lambda data: os.write(peer.serial, data), slice(half, None))
        over_tcp.join()
        same(node.wait(PATIENCE), 0, "exit code")
        until(lambda: all(listener.lines(f"wstac/{name}/end") for name in ("left", "right")), "the ends of the boards")
    count = 0
    for kind in ("features", "motion", "event", "contact_end", "end"):
        found = {name: timeless(of_kind(listener.lines(f"wstac/{name}/{kind}"), kind)) for name in ("left", "right")}
        # Boards do not send these.
        sent = [{name: value for name, value in record.items() if name not in ("acceleration", "period_mm", "sample")} for record in timeless(of_kind(expected, kind))]
        same(found["left"], sent, f"{kind} of the board behind TCP")
        same(found["right"], sent, f"{kind} of the board on a serial line")
        count += 2 * len(found["left"])
    state = listener.lines("wstac/left/state")[-1]
    same((state["frames"], state["events"], state["lost_events"]), (expected[-1]["frames"], 3, 0), "the board's last state")
    listener.close()
    # A port without a board, and one that cannot be opened.
    quiet = socket.create_server(("127.0.0.1", 0))
    with programs.node(f"tcp:127.0.0.1:{quiet.getsockname()[1]}", "--listen", endpoint) as node:
        quiet.accept()[0].close()
        same(node.wait(PATIENCE), 1, "exit code of a board that says nothing")
        same("expected those of a board" in node.said(), True, node.said())
    for source in ("tcp:127.0.0.1:1", "/dev/ttyNone"):
        done = subprocess.run([programs.command, source], capture_output=True, text=True, timeout=PATIENCE, check=False)
        same((done.returncode, source in done.stderr), (1, True), f"{source}: {done.stderr!r}")
    print(f"boards behind TCP and a serial line that was unplugged: {count} records as wstac run")


def check_config(programs):
    """Zenoh's own configuration decides which keys are heard."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    rule = {"id": "no taxels", "messages": ["put"], "flows": ["egress"], "permission": "deny", "key_exprs": ["wstac/*/taxels"]}
    policy = {"rules": [rule["id"]], "subjects": ["all"]}
    control = {"enabled": True, "default_permission": "allow", "rules": [rule], "subjects": [{"id": "all"}], "policies": [policy]}
    config = {"listen": {"endpoints": [endpoint]}, "scouting": {"multicast": {"enabled": False}}, "access_control": control}
    file = programs.folder / "zenoh.json5"
    file.write_text(json.dumps(config))
    with programs.node(programs.scene("sensor", 6), "--zenoh-config", file):
        listener = Listener(endpoint)
        until(lambda: len(listener.lines("wstac/sensor/features")) > 30, "features by a configuration")
        same(listener.lines("wstac/sensor/taxels"), [], "taxels that are denied")
        listener.close()
    at = f"127.0.0.1:{free_port()}"
    # Settings that the file does not name are safe. Those of Zenoh would listen at [::] and send multicast.
    for named, arguments, expected in (
        ({"access_control": control}, ["--listen", f"tcp/{at}"], [("tcp", at)]),
        ({"scouting": {"delay": 100}, "connect": {"endpoints": [endpoint]}, "mode": "router"}, [], []),
        ({"listen": {"endpoints": {"peer": [f"tcp/{at}"]}}}, [], [("tcp", at)]),
        ({"listen": {"exit_on_failure": True}}, [], [("tcp", "127.0.0.1:7447")]),
    ):
        # JSON5 has comments, and names without quotes.
        file.write_text(f"{{ // named\n id: \"abc1\", {json.dumps(named)[1:]}")
        with programs.node(programs.scene("sensor", 6), "--zenoh-config", file, *arguments) as node:
            if ("tcp", "127.0.0.1:7447") in expected and "Address already in use" in node.said():
                continue  # Another program has the default address.
            same(sockets(node), expected, f"sockets of a node with the settings {named}")
            same(node.said().count("abc1 listens"), 1, f"the node's identity in {node.said()!r}")
    for text, part in (
        ("{mode:", "expected"),
        ('{"no_such": 1}', "no_such"),
        ('{"scouting": {"multicast": {"enabled": "perhaps"}}}', "perhaps"),
        (None, "no such file"),
    ):
        file.write_text(text) if text is not None else file.unlink()
        done = subprocess.run([programs.command, "scene:Saw3@150", "--zenoh-config", file], capture_output=True, text=True, timeout=PATIENCE, check=False)
        if done.returncode != 1 or str(file) not in done.stderr or part not in done.stderr:
            fail(f"settings {text!r}: exit code {done.returncode}, {done.stderr!r}")
    print("a configuration of Zenoh: denied keys are not heard, what it does not name is safe, and a damaged one is refused by its name")


def check_removed(programs):
    """Options that were removed say what to use instead, as the changelog does."""
    changelog = (programs.page.parents[1] / "CHANGELOG.md").read_text()
    table = changelog.split("\n### From 0.3\n", 1)[1].split("\n### ", 1)[0]
    count = 0
    for what, instead in re.findall(r"^\| (`wstac-node --.*) \| (.*) \|$", table, re.MULTILINE):
        # As a terminal has it: links and code are words.
        instead = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", instead).replace("`", "")
        for number, option in enumerate(re.findall(r"`wstac-node (--[a-z-]+)`", what)):
            done = subprocess.run([programs.command, "a.y4m", option], capture_output=True, text=True, timeout=PATIENCE, check=False)
            _, said, words = done.stderr.partition(f"wstac-node {option}: was removed; help: ")
            same((done.returncode, bool(said and words.strip())), (2, True), f"{option}: {done.stderr!r}")
            # A row says of its first option what the program says.
            same(number > 0 or instead.startswith(words.splitlines()[0]), True, f"{option}: {words!r}, and the changelog {instead!r}")
            count += 1
    same(count, 6, "options that were removed")
    print(f"{count} options that were removed say what to use instead")


def check_page(programs):
    """The program of the page prints events of the page's scene, also if it is started after the first one."""
    page, endpoint = programs.page.read_text(), f"tcp/127.0.0.1:{free_port()}"
    code = next(block for block in re.findall(r"(?:^    .*\n|^\n)+", page, re.MULTILINE) if "import json, zenoh" in block)
    subprocess.run(["bash", "-c", re.search(r"^    (for n in .*)", page, re.MULTILINE)[1]], cwd=programs.folder, check=True)
    with programs.node(f"left=scene:{programs.folder / 'slides.toml'}", "--listen", endpoint):
        listener, command = Listener(endpoint), [sys.executable, "-u", "-c", textwrap.dedent(code).replace("tcp/127.0.0.1:7447", endpoint)]
        until(lambda: listener.lines("wstac/left/event"), "the first event")
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reader:
            line = reader.stdout.readline()
            reader.kill()
        listener.close()
    if not line.startswith("wstac/left/event slide {"):
        fail(f"the program of the page prints {line!r}")
    print(f"the program of the page: {line.strip()}")


CHECKS = {check.__name__.removeprefix("check_"): check for check in (
    check_arguments, check_messages, check_rates, check_several, check_hang, check_router, check_strangers, check_hostile, check_boards, check_config, check_tls, check_cdr, check_removed, check_page,
)}


def main():
    if len(sys.argv) < 3 or not CHECKS.keys() >= set(sys.argv[3:]):
        sys.exit(f"{__doc__}\nChecks: {' '.join(CHECKS)}")
    wstac, node = (Path(argument).resolve() for argument in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(wstac, node, Path(folder))
        for name in sys.argv[3:] or CHECKS:
            CHECKS[name](programs)


if __name__ == "__main__":
    run_main(main)
