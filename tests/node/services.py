"""Checks the services and parameters of wstac-node as a client of ROS 2 calls them over rmw_zenoh's keys."""

import os
import re
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import zenoh

from common import PATIENCE, Listener, fail, free_port, near, of_kind, same, until
from ros import DOMAIN, Client, in_ros

# Enough quiet frames at the start to begin a recording, whose baseline they are.
QUIET = 'lead_in = 150\ngap = 110\nseed = 9\nfidelity = "taxel"\n' + "".join(
    f'[[slide]]\nspecimen = "{name}"\nspeed = {speed}\ndirection = {way}\n'
    for name, speed, way in (("Saw3", 150, 90), ("Sin2", 170, 180), ("Tri4", 130, 300), ("Saw3", 160, 200))
)
# A message without fields, of which rosidl makes one byte.
EMPTY = b"\0\1\0\0\0"
LABELS = ["specimen=Saw3", "speed=150", "direction=90"]
SENSORS = ("left", "right", "deaf", "idle")
MODELS = Path(__file__).parents[2] / "wstac-host" / "models" / "path"
OF_NODE = {
    f"/wstac_node/{name}": f"rcl_interfaces::srv::dds_::{kind}_"
    for name, kind in (
        ("describe_parameters", "DescribeParameters"), ("get_parameters", "GetParameters"), ("get_parameter_types", "GetParameterTypes"),
        ("list_parameters", "ListParameters"), ("set_parameters", "SetParameters"), ("set_parameters_atomically", "SetParametersAtomically"),
    )
}
OF_SENSOR = {
    "restart_baseline": "std_srvs::srv::dds_::Trigger_", "stop_recording": "std_srvs::srv::dds_::Trigger_",
    "start_recording": "wstac_msgs::srv::dds_::StartRecording_",
    "load_configuration": "wstac_msgs::srv::dds_::LoadFile_", "load_model": "wstac_msgs::srv::dds_::LoadFile_",
}


def refused(answer, part, what):
    if answer.success or part not in answer.message:
        fail(f"{what}: {answer}, expected {part!r}")


def done(answer, what):
    same(answer.success, True, f"{what}, which says {answer.message!r}")


def check_services(programs):
    """Services are found by their tokens, do what they say, and refuse what they cannot do."""
    endpoint, folder = f"tcp/127.0.0.1:{free_port()}", programs.folder / "files"
    folder.mkdir()
    scene = programs.folder / "quiet.toml"
    scene.write_text(QUIET)
    (folder / "wrong.toml").write_text("[trigger]\nno_such = 1\n")
    (folder / "deaf.toml").write_text("[trigger]\nmargin = 30.0\n")
    (folder / "taken.mcap").write_bytes(b"kept")
    (folder / "none.wsm").write_bytes(b"no model")
    for name in ("pipe.toml", "pipe.wsm", "pipe.mcap"):
        os.mkfifo(folder / name)
    (folder / "device.toml").symlink_to("/dev/zero")
    (folder / "link.toml").symlink_to(folder / "deaf.toml")
    (folder / "link.wsm").symlink_to("/etc/passwd")
    shutil.copy(MODELS / "path-svm.wsm", folder / "path-svm.wsm")
    sensors = [f"{name}=scene:{scene}" for name in SENSORS]
    with programs.node(*sensors, "--ros", "--zenoh", "--domain", DOMAIN, "--files", folder, "--listen", endpoint) as node:
        client, listener = Client(endpoint, DOMAIN), Listener(endpoint)
        changes = Listener(endpoint, f"{DOMAIN}/parameter_events/**", raw=True)
        expected = {f"/wstac/{name}/{service}": kind for name in SENSORS for service, kind in OF_SENSOR.items()}
        same({name: kind for name, (kind, _) in client.services().items()}, expected | OF_NODE, "services that tokens describe")

        start = client.call("/wstac/left/start_recording", file="slide.mcap", features_only=True, labels=LABELS)
        done(start, "start of a recording")
        same(start.recorded, str(folder / "slide.mcap"), "file of the recording")
        strangers(client)
        refused(client.call("/wstac/left/start_recording"), "in progress", "a second recording")
        refused(client.call("/wstac/left/load_model", file="path-svm.wsm"), "in progress", "a model in a recording")
        refused(client.call("/wstac/left/restart_baseline"), "in progress", "a new baseline in a recording")
        for file, part in (("../slide.mcap", "without folders"), ("taken.mcap", "taken.mcap"), ("slide.txt", "expected the ending .mcap")):
            refused(client.call("/wstac/right/start_recording", file=file, features_only=True), part, f"a recording {file}")
        refused(client.call("/wstac/right/start_recording", file="a.mcap"), "features_only", "pictures of a sensor without any")
        for labels, part in ((["Saw3"], "NAME=VALUE"), (["speed=fast"], "expected mm/s"), (["note=a\x1b"], "control characters")):
            refused(client.call("/wstac/right/start_recording", file="a.mcap", features_only=True, labels=labels), part, f"labels {labels}")
        same((folder / "a.mcap").exists(), False, "a file of a recording that was refused")
        refused(client.call("/wstac/right/stop_recording"), "no recording", "the end of no recording")
        same((folder / "taken.mcap").read_bytes(), b"kept", "a file that was there")
        refused(client.call("/wstac/right/load_configuration", file="wrong.toml"), "the output of wstac-node says why", "a wrong configuration")
        refused(client.call("/wstac/right/load_model", file="none.wsm"), "none.wsm", "a file that is no model")
        refused(client.call("/wstac/right/load_model", file="/etc/passwd"), "without folders", "a file elsewhere")
        # What could be waited for forever is refused, and the sensor goes on.
        for service, file in (("load_configuration", "pipe.toml"), ("load_model", "pipe.wsm")):
            refused(client.call(f"/wstac/right/{service}", file=file), "is a device or a pipe, expected a file", file)
        for service, file in (("load_configuration", "device.toml"), ("load_configuration", "link.toml"), ("load_model", "link.wsm")):
            refused(client.call(f"/wstac/right/{service}", file=file), "is a link, expected a file", file)
        refused(client.call("/wstac/right/start_recording", file="pipe.mcap", features_only=True), "File exists", "a recording to a pipe")
        before = len(listener.lines("wstac/right/features"))
        until(lambda: len(listener.lines("wstac/right/features")) > before + 10, "features after refusals")
        # A sensor whose baseline is always new has no event.
        over = threading.Event()

        def restart():
            other = Client(endpoint, DOMAIN)
            while not over.wait(0.2):
                done(other.call("/wstac/deaf/restart_baseline"), "a new baseline")
            other.close()

        restarts = threading.Thread(target=restart)
        restarts.start()
        done(client.call("/wstac/right/load_model", file="path-svm.wsm"), "a model")
        done(client.call("/wstac/idle/load_configuration", file="deaf.toml"), "a configuration")
        loaded = client.call("/wstac_node/get_parameters", names=["idle.configuration", "right.models", "left.models"]).values
        found = (loaded[0].string_value, loaded[1].string_array_value, loaded[2].string_array_value)
        same(found, (str(folder / "deaf.toml"), [str(folder / "path-svm.wsm")], []), "parameters after files were loaded")
        until(lambda: changes.messages and len(*changes.messages.values()) == 2, "two changes of parameters by services")
        (right, idle) = in_ros(client.types, changes.messages, "left")["parameter_events"]
        found = [[(one.name, one.value.string_value or one.value.string_array_value) for one in event.changed_parameters] for event in (right, idle)]
        same(found, [[("right.models", [str(folder / "path-svm.wsm")])], [("idle.configuration", str(folder / "deaf.toml"))]], "changes of parameters by services")
        changes.close()
        # Nobody ends this one: the end of the source does. It has the first name that is free.
        unnamed = client.call("/wstac/idle/start_recording", features_only=True)
        same(unnamed.recorded, str(folder / "idle-1.mcap"), "file of a recording without a name")
        rogue(client, node)
        until(lambda: len(listener.lines("wstac/left/event")) == 2, "two events")
        time.sleep(1)
        stop = client.call("/wstac/left/stop_recording")
        done(stop, "the end of a recording")
        if not re.search(r"slide\.mcap: \d+ frames recorded", stop.message):
            fail(f"the end of a recording says {stop.message!r}")
        recorded = of_kind(programs.run(folder / "slide.mcap"), "event")
        check_labels(programs, folder / "slide.mcap")
        until(lambda: listener.lines("wstac/left/end") and listener.lines("wstac/right/end"), "the ends")
        over.set()
        restarts.join()
        node.wait(60)
    same(f"{folder}/idle-1.mcap: " in node.said(), True, f"the note about a recording that the source ended: {node.said()!r}")
    whole = programs.run(folder / "idle-1.mcap")[-1]
    same((whole["kind"], whole["frames"] > 300, whole["dropped"]), ("end", True, 0), "a recording that the source ended")
    check_recording(recorded, of_kind(listener.lines("wstac/left/event"), "event"))
    for name in ("left", "right", "idle"):
        # A recording, one that was refused and a configuration leave the times of what is published as they are.
        frames = [record["frame"] for record in listener.lines(f"wstac/{name}/features")]
        same(frames, sorted(set(frames)), f"frames of {name}")
        for record in listener.lines(f"wstac/{name}/features"):
            near(record["time_ns"] / 1e9, record["frame"] / 30, 1e-6, f"time of frame {record['frame']} of {name}")
    named = [event["texture"]["specimen"] for event in listener.lines("wstac/right/event")]
    same(len(named), 4, "events of a sensor whose model was loaded")
    same(all(named), True, f"textures by a model that was loaded: {named}")
    same([event.get("texture") for event in listener.lines("wstac/left/event")], [None] * 4, "textures without a model")
    same(listener.lines("wstac/deaf/event"), [], "events of a sensor whose baseline is always new")
    same(listener.lines("wstac/idle/event"), [], "events by a configuration that finds none")
    for name in ("deaf", "idle"):
        same(len(listener.lines(f"wstac/{name}/features")) > 300, True, f"features of {name}")
    client.close(), listener.close()
    print(f"services: {len(expected) + len(OF_NODE)} found by tokens; a recording, a model and baselines; what cannot be done is refused")


def check_labels(programs, file):
    """A recording has its labels, by which it is part of a data set, and its events are words."""
    done = subprocess.run([programs.wstac, "dataset", file, "-o", file.with_suffix(".npz")], capture_output=True, text=True, timeout=PATIENCE, check=False)
    same(done.returncode, 0, f"exit code of a data set of the recording: {done.stderr!r}")
    if not re.search(rb"event at frame \d+: slide, speed", file.read_bytes()):
        fail(f"{file.name}: no event in words")


def check_recording(recorded, events):
    """A recording replays to the events of its time."""
    same(len(recorded), 2, "events of the recording")
    zero = events[0]["frame"] - recorded[0]["frame"]
    same(0 < zero < 100, True, f"first frame of the recording, {zero}")
    for one, other in zip(recorded, events, strict=False):
        same(one["frame"] + zero, other["frame"], "frame of a recorded event")
        for field in ("contact", "speed", "direction", "reliable"):
            same(one[field], other[field], f"{field} of a recorded event")


def strangers(client):
    """Requests that ask for everything, and those that are no empty message: no recording ends, and no baseline begins."""
    end = "/wstac/left/stop_recording"
    everything = ("**", "*/**", f"{DOMAIN}/**", f"{DOMAIN}/wstac/*/stop_recording/**", f"{DOMAIN}/*/left/restart_baseline/**")
    for key in everything:
        for target in (zenoh.QueryTarget.BEST_MATCHING, zenoh.QueryTarget.ALL):
            replies = list(client.session.get(key, payload=EMPTY, target=target, consolidation=zenoh.ConsolidationMode.NONE, timeout=PATIENCE))
            answers = [str(reply.ok.key_expr) for reply in replies if reply.ok and str(reply.ok.key_expr).startswith(f"{DOMAIN}/")]
            same(answers, [], f"answers of services to {key}")
            errors = {reply.err.payload.to_string() for reply in replies if reply.err}
            same(errors, {"the key has wildcards, expected that of one service"}, f"errors for {key}")
    for payload in (None, b"", b"\0\1\0", b"\0\0\0\0\0", EMPTY + b"\0", bytes(100)):
        same([reply.ok is None for reply in client.ask(end, payload, None)], [True], f"answers of {end} to {payload}")


def rogue(client, node):
    """Requests that are no messages: an error, no answer that looks like one, and nothing changes."""
    for service, payload in (
        ("/wstac_node/set_parameters", b""),
        ("/wstac_node/get_parameters", b"\0\1\0\0\xff\xff\xff\xff"),
        ("/wstac_node/get_parameters", b"\0\1\0\0\x41\0\0\0" + 65 * b"\2\0\0\0a\0\0\0"),
        ("/wstac_node/list_parameters", bytes(100_000)),
        ("/wstac/right/load_model", b"\0\1\0\0\xff\xff\xff\x7fa\0"),
        ("/wstac/right/start_recording", b"\0\1\0\0"),
    ):
        for attachment in (None, b"", bytes(40), bytes(100_000)):
            replies = client.ask(service, payload, attachment)
            same([reply.ok is None for reply in replies], [True], f"answers of {service} to {payload[:20]!r}")
    # What is far too long is not even gathered.
    before = most_memory(node)
    replies = client.ask("/wstac_node/list_parameters", bytes(60_000_000), None, timeout=3)
    same([reply.err.payload.to_string() for reply in replies], ["Timeout"], "answers to 60 MB")
    same(most_memory(node) - before < 20_000, True, f"kB of memory for a request of 60 MB: {most_memory(node)} instead of {before}")


def most_memory(node):
    """Returns the most memory that the node ever had, in kB."""
    status = Path(f"/proc/{node.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s*(\d+)", status)[1])


def check_ends(programs):
    """Whoever asks without end does not hold up a sensor, and every request is answered, also at the sensor's end."""
    endpoint, count = f"tcp/127.0.0.1:{free_port()}", 8
    scenes = {"brief": "lead_in = 120", "long": "lead_in = 400"}
    for name, lead_in in scenes.items():
        slide = '[[slide]]\nspecimen = "Saw3"\nspeed = 150\ndirection = 0\n'
        (programs.folder / f"{name}.toml").write_text(f'{lead_in}\ngap = 30\nseed = 3\nfidelity = "taxel"\n{slide}')
    sensors = [f"{name}=scene:{programs.folder}/{name}.toml" for name in scenes]
    with programs.node(*sensors, "--ros", "--zenoh", "--domain", DOMAIN, "--listen", endpoint) as node:
        listener = Listener(endpoint)
        answers = [[] for _ in range(count)]

        def ask(own):
            client = Client(endpoint, DOMAIN)
            while not own or own[-1].success:
                own.append(client.call("/wstac/brief/restart_baseline"))
            client.close()

        threads = [threading.Thread(target=ask, args=(own,)) for own in answers]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        same(listener.lines("wstac/long/end"), [], "the end of the sensor that goes on")
        until(lambda: listener.lines("wstac/brief/end"), "the end")
        node.send_signal(signal.SIGINT)
        same(node.wait(PATIENCE), 0, "exit code")
    same([own[-1].message for own in answers], ["brief: has ended"] * count, "the last answers")
    given = sum(len(own) for own in answers) - count
    frames = listener.lines("wstac/brief/end")[0]["frames"]
    same(count < given <= frames, True, f"{given} requests that were followed in {frames} frames")
    listener.close()
    print(f"ends: {given} requests without a pause, and all {count} that waited at the end are answered")


def check_parameters(programs):
    """Parameters are listed, described, read and changed; those that are read-only are not changed."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    source = programs.scene("sensor", 10)
    with programs.node(f"left={source}", "--ros", "--domain", DOMAIN, "--node-name", "hand", "--listen", endpoint):
        client, listener = Client(endpoint, DOMAIN), Listener(endpoint, f"{DOMAIN}/**", raw=True)
        names = ["domain", "namespace", *(f"left.{name}" for name in ("configuration", "frame_id", "models", "picture", "source"))]
        everything = client.call("/hand/list_parameters").result
        same((everything.names, everything.prefixes), (names, ["left"]), "parameters")
        for prefixes, depth, found in ((["left"], 0, names[2:]), ([], 1, names[:2]), (["lef"], 0, []), (["domain"], 1, ["domain"])):
            same(client.call("/hand/list_parameters", prefixes=prefixes, depth=depth).result.names, found, f"parameters {prefixes}, {depth}")
        types = {"domain": 2, "left.frame_id": 4, "left.picture": 1, "left.models": 9, "none": 0, "left.none": 0, "right.picture": 0}
        same(bytes(client.call("/hand/get_parameter_types", names=list(types)).types), bytes(types.values()), "types of parameters")
        values = client.call("/hand/get_parameters", names=["domain", "left.frame_id", "left.picture", "left.source", "left.models", "none"]).values
        found = [value.type for value in values]
        same(found, [2, 4, 1, 4, 9, 0], "types of values")
        same((values[0].integer_value, values[1].string_value, values[2].bool_value), (DOMAIN, "left_frame", False), "values")
        same((values[3].string_value, values[4].string_array_value), (source, []), "values")
        described = client.call("/hand/describe_parameters", names=["left.picture", "left.source"]).descriptors
        same([(one.name, one.type, one.read_only) for one in described], [("left.picture", 1, False), ("left.source", 4, True)], "descriptions")

        def parameter(name, kind, **fields):
            value = client.message("rcl_interfaces/msg/ParameterValue", type=kind, **fields)
            return client.message("rcl_interfaces/msg/Parameter", name=name, value=value)

        wrong = [
            (parameter("left.source", 4, string_value="x"), "read-only"), (parameter("left.picture", 4, string_value="x"), "type"),
            (parameter("none", 1, bool_value=True), "no such"), (parameter("left.frame_id", 4, string_value=""), "expected 1 to 255"),
            (parameter("left.frame_id", 4, string_value="a\u202eb"), "expected 1 to 255 visible"),
            (parameter("left.frame_id", 8, double_array_value=[0.5, 1.5]), "type"),
        ]
        results = client.call("/hand/set_parameters", parameters=[one for one, _ in wrong]).results
        for result, (_, part) in zip(results, wrong, strict=True):
            same((result.successful, part in result.reason), (False, True), f"reason {result.reason!r}")
        frame, picture = parameter("left.frame_id", 4, string_value="finger"), parameter("left.picture", 1, bool_value=True)
        same(client.call("/hand/set_parameters_atomically", parameters=[frame, wrong[0][0]]).result.successful, False, "all or none")
        same(client.call("/hand/get_parameters", names=["left.frame_id"]).values[0].string_value, "left_frame", "a value that is kept")
        pictures = next(key for key in (f"{DOMAIN}/wstac/left/picture/",))
        same([key for key in listener.messages if key.startswith(pictures)], [], "pictures that are off")
        same([result.successful for result in client.call("/hand/set_parameters", parameters=[frame, picture]).results], [True, True], "changes")
        until(lambda: any(key.startswith(pictures) for key in listener.messages), "pictures that are on")

        # The changes were published, each with its value and the name of the node.
        (events,) = (all_ for key, all_ in list(listener.messages.items()) if key.startswith(f"{DOMAIN}/parameter_events/"))
        until(lambda: len(events) == 2, "two changes of parameters")
        found = in_ros(client.types, {key: all_ for key, all_ in listener.messages.items() if "/parameter_events/" in key}, "left")["parameter_events"]
        same([(event.node, event.new_parameters, event.deleted_parameters) for event in found], [("/hand", [], [])] * 2, "changes of parameters")
        changed = [[(one.name, one.value.type, one.value.string_value or one.value.bool_value) for one in event.changed_parameters] for event in found]
        same(changed, [[("left.frame_id", 4, "finger")], [("left.picture", 1, True)]], "changes of parameters")
        same(all(abs(event.stamp.sec - time.time()) < 60 for event in found), True, "times of the changes")

        def frames(kind):
            """Returns the coordinate frame of the last message."""
            payload = next(all_[-1][0] for key, all_ in list(listener.messages.items()) if key.startswith(f"{DOMAIN}/wstac/left/{kind}/"))
            name = {"picture": "sensor_msgs/msg/Image", "features": "wstac_msgs/msg/Features"}[kind]
            return client.types.deserialize_cdr(payload, name).header.frame_id

        until(lambda: frames("picture") == frames("features") == "finger", "the new coordinate frame")
        refused(client.call("/wstac/left/load_model", file="a.wsm"), "--files", "a model without a folder")
        refused(client.call("/wstac/left/start_recording", features_only=True), "--files", "a recording without a folder")
        client.close(), listener.close()
    print(f"parameters: {len(names)} listed, described, read and changed")
