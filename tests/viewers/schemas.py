"""Checks every JSON message of recordings, and lines of `wstac run --json`, against the schema in the file.

A field that the schema does not know, or a known one that is missing, fails: the schema says all there is. The layout
for Foxglove is checked against the topics and the fields that a recording has.
"""

import copy
import json
from pathlib import Path

from jsonschema import Draft7Validator
from mcap.reader import make_reader

LAYOUT = Path(__file__).resolve().parents[2] / "docs" / "viewers" / "foxglove.json"
NAMES = [f"{line}{number}" for line in "rc" for number in range(1, 6)]
# Which panel shows messages of which schemas.
PANELS = {
    "Image": ("foxglove.RawImage", "foxglove.CompressedImage"),
    "Plot": ("std_msgs/msg/Float64MultiArray",),
    "RosOut": ("foxglove.Log",),
    "RawMessages": ("wstac.Record",),
}


def json_messages(file):
    """Returns the schemas by topic, the one schema of all JSON messages, and these messages."""
    schemas, messages, text = {}, [], set()
    with open(file, "rb") as opened:
        for schema, channel, message in make_reader(opened).iter_messages():
            schemas[channel.topic] = schema.name
            if channel.message_encoding == "json":
                assert (schema.name, schema.encoding) == ("wstac.Record", "jsonschema"), schema
                text.add(schema.data)
                messages.append(json.loads(message.data))
    assert len(text) == 1, f"{file}: {len(text)} schemas of one name"
    return schemas, json.loads(text.pop()), messages


def members(message):
    """Returns all objects in a message, with the path to each."""
    found = [message]
    for value in message.values():
        if isinstance(value, dict):
            found += members(value)
    return found


def check(validator, messages):
    """Checks messages, and that the schema refuses each of them with another type or with a field of an unknown name."""
    kinds = {}
    for message in messages:
        errors = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(message)]
        assert not errors, (message, errors)
        kinds.setdefault(message["kind"], message)
    for message in kinds.values():
        for place in range(len(members(message))):
            changed = copy.deepcopy(message)
            within = members(changed)[place]
            # Losses have a member for each reason, of other versions, too, whose value is a number.
            within["unknown"] = "1" if within is changed.get("dropped_by") else 1
            assert not validator.is_valid(changed), changed
        for name in message:
            changed = copy.deepcopy(message)
            changed[name] = [[True]]
            assert not validator.is_valid(changed), changed
    return kinds


def check_required(validator, message, optional):
    """Checks that the schema misses every field that is not optional."""
    for name in set(message) - set(optional):
        without = {key: value for key, value in message.items() if key != name}
        assert not validator.is_valid(without), f"{message['kind']} without {name}"


def check_recording(file):
    """Checks all JSON messages of a recording. Returns their number."""
    _, schema, messages = json_messages(file)
    Draft7Validator.check_schema(schema)
    kinds = check(Draft7Validator(schema), messages)
    assert {"event", "end", "sum"} <= set(kinds), set(kinds)
    return len(messages)


def check_lines(file, outputs):
    """Checks lines of wstac run --json against the schema of a recording. Returns the kinds that were there."""
    _, schema, _ = json_messages(file)
    validator = Draft7Validator(schema)
    kinds, extents = {}, 0
    for lines in outputs:
        found = check(validator, [json.loads(line) for line in lines])
        kinds.update(found)
        extents += {"basis", "place_mm", "width_mm", "contacts"} <= set(found.get("event", {}))
    assert extents, "no event has a place and a width"
    for kind, message in kinds.items():
        optional = {"speed_at_most", "basis", "place_mm", "width_mm", "period_mm", "contacts", "acceleration", "why", "sample", "sensor", "dropped_by", "lost_events", "readout_ms"}
        check_required(validator, message, optional)
        # Lists of numbers and counts by reason are of their kind alone: viewers do not show them.
        of_kind = (rule["then"] for rule in schema["allOf"] if rule["if"]["properties"]["kind"].get("const") == kind)
        known = set(schema["properties"]).union(*(then.get("properties", {}) for then in of_kind))
        assert set(message) <= known | {"sample"}, kind
    return sorted(kinds)


def check_layout(file, sensor=""):
    """Checks that the layout shows the topics of a recording, in panels that can, with the names of the features. For a
    sensor, such as /left, its topics are replaced as the page says.
    """
    schemas, _, messages = json_messages(file)
    layout = json.loads(LAYOUT.read_text().replace('"/', f'"{sensor}/'))
    panels = layout["configById"]

    def placed(part):
        return [part] if isinstance(part, str) else placed(part["first"]) + placed(part["second"])

    assert sorted(placed(layout["layout"])) == sorted(panels), "every panel has one place"
    shown, names = set(), []
    for name, panel in panels.items():
        kind = name.split("!")[0]
        topics = {
            "Image": lambda panel: [panel["imageMode"]["imageTopic"]],
            "Plot": lambda panel: [path["value"] for path in panel["paths"]],
            "RosOut": lambda panel: [panel["topicToRender"]],
            "RawMessages": lambda panel: [panel["topicPath"]],
        }[kind](panel)
        for path in topics:
            topic = path.split(".")[0]
            assert topic in schemas, f"{file} has no {topic}, which {name} shows"
            assert schemas[topic] in PANELS[kind], (name, path, schemas)
            shown.add(topic)
        if kind == "Plot":
            names += [(path["label"], path["value"]) for path in panel["paths"]]
    assert names == [(name, f"{sensor}/features.data[{number}]") for number, name in enumerate(NAMES)], names
    assert {f"{sensor}/{topic}" for topic in ("camera", "taxels", "features", "events", "events/json", "faults")} == shown, shown
    return len(panels)
