"""Messages of ROS 2, read and written by rosbags, which shares no code with wstac-node."""

from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from common import PATIENCE, Listener, free_port, same, until

HELD = f"scene:{Path(__file__).parents[1]}/firmware/held.toml"
MESSAGES = Path(__file__).parents[2] / "wstac-ros" / "wstac_msgs" / "msg"


def types_of_ros():
    """Returns the types of ROS 2 with those of wstac_msgs, read from their definitions."""
    types = get_typestore(Stores.ROS2_JAZZY)
    for file in MESSAGES.glob("*.msg"):
        types.register(get_types_from_msg(file.read_text(), f"wstac_msgs/msg/{file.stem}"))
    return types


def numbers(slip):
    """Returns the numbers of a slip, a message or a record."""
    fields = ("frame", "onset_frame", "held_since_frame", "strength")
    return {field: slip[field] if isinstance(slip, dict) else getattr(slip, field) for field in fields}


def check_cdr(programs):
    """Under the keys of JSON, payloads are messages of ROS 2, with their type as the encoding; a late reader gets them, too."""
    source, endpoint, types = programs.scene("sensor", 12), f"tcp/127.0.0.1:{free_port()}", types_of_ros()
    expected, slips = programs.run(source), [record for record in programs.run(HELD) if record["kind"] == "slip"]
    with programs.node(f"sensor={source}", f"held={HELD}", "--zenoh-encoding", "cdr", "--listen", endpoint) as node:
        listener = Listener(endpoint, raw=True)
        until(lambda: len(listener.messages.get("wstac/sensor/event", [])) == 3, "three events")
        kept = [reply.ok for reply in listener.session.get("wstac/sensor/event/*", timeout=PATIENCE)]
        same(node.wait(PATIENCE), 0, "exit code")
        until(lambda: all(listener.messages.get(f"wstac/{name}/end") for name in ("sensor", "held")), "the ends")
    names = {"event": "wstac_msgs/msg/Event", "contact_end": "wstac_msgs/msg/ContactEnd", "motion": "geometry_msgs/msg/TwistStamped"}
    names |= {"features": "wstac_msgs/msg/Features", "taxels": "wstac_msgs/msg/Taxels"}
    found = {}
    for kind, name in {**names, "slip": "wstac_msgs/msg/Slip"}.items():
        sensor = "held" if kind == "slip" else "sensor"
        for payload, _, encoding in listener.messages[f"wstac/{sensor}/{kind}"]:
            same(encoding, f"application/cdr;{name}", f"encoding of {kind}")
            message = types.deserialize_cdr(payload, name)
            same(bytes(types.serialize_cdr(message, name)), payload, f"bytes of {kind}, written again")
            found.setdefault(kind, []).append(message)
    events = [record["frame"] for record in expected if record["kind"] == "event"]
    same([event.frame for event in found["event"]], events, "events in CDR")
    same([{**one, "strength": round(one["strength"], 2)} for one in map(numbers, found["slip"])], list(map(numbers, slips)), "slips in CDR")
    same([attachment for _, attachment, _ in listener.messages["wstac/sensor/event"]], [b"0", b"1", b"2"], "numbers of events")
    late = {str(sample.key_expr): (types.deserialize_cdr(sample.payload.to_bytes(), names["event"]).frame, str(sample.encoding)) for sample in kept}
    same(late, {f"wstac/sensor/event/{k}": (frame, f"application/cdr;{names['event']}") for k, frame in enumerate(events)}, "events for a late reader")
    same({encoding for _, _, encoding in listener.messages["wstac/sensor/end"]}, {"application/json"}, "encoding of the end")
    listener.close()
    print(f"CDR: {sum(map(len, found.values()))} messages under the keys of JSON")
