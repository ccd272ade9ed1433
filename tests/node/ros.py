"""Messages and services of ROS 2, read and written by rosbags, which shares no code with wstac-node."""

import re
import struct
import time
from pathlib import Path

import numpy
import zenoh
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from common import PATIENCE, Listener, fail, free_port, same, session, until

MESSAGES = Path(__file__).parents[2] / "wstac-node" / "wstac_msgs" / "msg"
DOMAIN = 7


def types_of_ros():
    """Returns the types of ROS 2 with those of wstac_msgs, read from their definitions."""
    types = get_typestore(Stores.ROS2_JAZZY)
    for file in MESSAGES.glob("*.msg"):
        types.register(get_types_from_msg(file.read_text(), f"wstac_msgs/msg/{file.stem}"))
    return types


def in_ros(types, messages, sensor):
    """Decodes what has arrived for ROS 2: the messages of each topic. Keys, hashes, bytes and attachments are right."""
    found = {}
    for key, arrived in messages.items():
        domain, rest = key.split("/", 1)
        topic, name, digest = rest.rsplit("/", 2)
        same(domain, str(DOMAIN), f"domain of {key}")
        name = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", name).expand(r"\1/msg/\2")
        same(digest, types.hash_rihs01(name), f"hash of {name}")
        publishers, before = set(), 0
        for count, (payload, attachment, _) in enumerate(arrived):
            message = types.deserialize_cdr(payload, name)
            same(bytes(types.serialize_cdr(message, name)), payload, f"bytes of {name}, written again")
            sequence, stamp, length = struct.unpack_from("<qqB", attachment)
            same((len(attachment), length), (33, 16), f"attachment of {name}")
            same(abs(stamp / 1e9 - time.time()) < 10 * PATIENCE, True, f"time in the attachment of {name}")
            # A slow subscriber may miss pictures, which are large.
            expected = range(before + 1, before + 100) if count and topic.endswith("/picture") else [before + 1 if count else sequence]
            same(sequence in expected, True, f"number {sequence} of a message of {name} after {before}")
            before = sequence
            publishers.add(attachment[17:])
            found.setdefault(topic.removeprefix(f"wstac/{sensor}/"), []).append(message)
        same(len(publishers), 1, f"publishers of {key}")
    return found


# Services that no definition of this repository has, as their packages define them: request, then answer.
SERVICES = {
    "std_srvs/srv/Trigger": "---\nbool success\nstring message\n",
    "rcl_interfaces/srv/ListParameters": "string[] prefixes\nuint64 depth\n---\nrcl_interfaces/msg/ListParametersResult result\n",
    "rcl_interfaces/srv/GetParameters": "string[] names\n---\nrcl_interfaces/msg/ParameterValue[] values\n",
    "rcl_interfaces/srv/GetParameterTypes": "string[] names\n---\nuint8[] types\n",
    "rcl_interfaces/srv/DescribeParameters": "string[] names\n---\nrcl_interfaces/msg/ParameterDescriptor[] descriptors\n",
    "rcl_interfaces/srv/SetParameters": (
        "rcl_interfaces/msg/Parameter[] parameters\n---\nrcl_interfaces/msg/SetParametersResult[] results\n"
    ),
    "rcl_interfaces/srv/SetParametersAtomically": (
        "rcl_interfaces/msg/Parameter[] parameters\n---\nrcl_interfaces/msg/SetParametersResult result\n"
    ),
    # Its hash is in the design of rmw_zenoh, so it checks how hashes are computed here.
    "example_interfaces/srv/AddTwoInts": "int64 a\nint64 b\n---\nint64 sum\n",
}
PUBLISHED = {"example_interfaces/srv/AddTwoInts": "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"}


def defined(text, name):
    """Returns the types of a definition. rosbags writes the types of services as a/srv/msg/B."""

    def named(part):
        if isinstance(part, str):
            return part.replace("/srv/msg/", "/srv/")
        return type(part)(map(named, part)) if isinstance(part, tuple | list) else part

    return {named(key): named(definition) for key, definition in get_types_from_msg(text, name).items()}


def register_services(types):
    """Adds the messages of all services, as rosidl derives them: request, answer, event, and the three of them."""
    services = dict(SERVICES)
    # rosidl makes uint8 of char before it computes a hash, and rosbags does not.
    info = "service_msgs/msg/ServiceEventInfo"
    gid = ("client_gid", (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)))
    constants, fields = types.fielddefs[info]
    types.fielddefs[info] = (constants, [gid if field[0] == "client_gid" else field for field in fields])
    for file in (MESSAGES.parent / "srv").glob("*.srv"):
        services[f"wstac_msgs/srv/{file.stem}"] = file.read_text()
    for name, text in services.items():
        request, _, answer = text.partition("---\n")
        for part, fields in (("Request", request), ("Response", answer)):
            has_fields = any(line.partition("#")[0].strip() for line in fields.splitlines())
            # rosidl gives an empty message one byte.
            types.register(defined(fields if has_fields else "uint8 structure_needs_at_least_one_member\n", f"{name}_{part}"))
        types.register(
            defined(
                f"service_msgs/msg/ServiceEventInfo info\n{name}_Request[<=1] request\n{name}_Response[<=1] response\n", f"{name}_Event"
            )
        )
        parts = (("request", "Request"), ("response", "Response"), ("event", "Event"))
        types.register(defined("".join(f"{name}_{part} {field}_message\n" for field, part in parts), name))
    for name, digest in PUBLISHED.items():
        same(types.hash_rihs01(name), digest, f"hash of {name} by this check")
    return list(services)


class Client:
    """Calls services as rmw_zenoh does. It finds them by their tokens."""

    GID = bytes(range(16))

    def __init__(self, endpoint, domain):
        self.types, self.domain, self.number = types_of_ros(), domain, 0
        register_services(self.types)
        self.session = session("client", connect=endpoint)

    def services(self):
        """Returns the type and the hash of every service, by its name."""
        replies = self.session.liveliness().get(f"@ros2_lv/{self.domain}/**", timeout=PATIENCE)
        tokens = [str(reply.ok.key_expr).split("/") for reply in replies]
        return {token[9].replace("%", "/"): tuple(token[10:12]) for token in tokens if token[5] == "SS"}

    def message(self, name, /, **fields):
        """Makes a message. Fields that are not given are empty."""
        kinds = {field: kind for field, kind in self.types.fielddefs[name][1]}
        empty = {"string": "", "bool": False, "float64": 0.0}

        def value(field):
            kind = kinds[field]
            if kind[0] == Nodetype.SEQUENCE and kind[1][0][0] == Nodetype.BASE and kind[1][0][1][0] != "string":
                return numpy.array(fields.get(field, []), dtype={"byte": "uint8"}.get(kind[1][0][1][0], kind[1][0][1][0]))
            if field in fields:
                return fields[field]
            if kind[0] == Nodetype.NAME:
                return self.message(kind[1])
            return empty.get(kind[1][0], 0) if kind[0] == Nodetype.BASE else []

        return self.types.types[name](**{field: value(field) for field in kinds})

    def ask(self, service, payload, attachment, timeout=PATIENCE):
        """Sends bytes to a service. Returns its replies."""
        kind, digest = self.services()[service]
        key = f"{self.domain}/{service.removeprefix('/')}/{kind}/{digest}"
        replies = self.session.get(
            key, payload=payload, attachment=attachment, timeout=timeout,
            target=zenoh.QueryTarget.ALL_COMPLETE, consolidation=zenoh.ConsolidationMode.NONE,
        )
        return list(replies)

    def call(self, service, **fields):
        """Calls a service, and returns its answer."""
        kind, digest = self.services()[service]
        name = re.fullmatch(r"(\w+)::srv::dds_::(\w+)_", kind).expand(r"\1/srv/\2")
        same(digest, self.types.hash_rihs01(name), f"hash of {name}")
        self.number += 1
        request = self.types.serialize_cdr(self.message(f"{name}_Request", **fields), f"{name}_Request")
        replies = self.ask(service, bytes(request), struct.pack("<qqB16s", self.number, time.time_ns(), 16, self.GID))
        same(len(replies), 1, f"answers of {service}")
        if replies[0].ok is None:
            fail(f"{service}: {replies[0].err.payload.to_string()}")
        number, stamp, length, gid = struct.unpack("<qqB16s", replies[0].ok.attachment.to_bytes())
        same((number, length, gid), (self.number, 16, self.GID), f"attachment of an answer of {service}")
        same(abs(stamp / 1e9 - time.time()) < PATIENCE, True, f"time in the attachment of {service}")
        payload = replies[0].ok.payload.to_bytes()
        answer = self.types.deserialize_cdr(payload, f"{name}_Response")
        same(bytes(self.types.serialize_cdr(answer, f"{name}_Response")), payload, f"bytes of an answer of {service}, written again")
        return answer

    def close(self):
        self.session.close()


def check_cdr(programs):
    """Under the keys of JSON, payloads are messages of ROS 2, with their type as the encoding; a late reader gets them, too."""
    source, endpoint, types = programs.scene("sensor", 12), f"tcp/127.0.0.1:{free_port()}", types_of_ros()
    expected = programs.run(source)
    with programs.node(source, "--zenoh-encoding", "cdr", "--listen", endpoint) as node:
        listener = Listener(endpoint, raw=True)
        until(lambda: len(listener.messages.get("wstac/sensor/event", [])) == 3, "three events")
        kept = [reply.ok for reply in listener.session.get("wstac/sensor/event/*", timeout=PATIENCE)]
        same(node.wait(PATIENCE), 0, "exit code")
        until(lambda: listener.messages.get("wstac/sensor/end"), "the end")
    names = {"event": "wstac_msgs/msg/Event", "contact_end": "wstac_msgs/msg/ContactEnd", "motion": "geometry_msgs/msg/TwistStamped"}
    names |= {"features": "wstac_msgs/msg/Features", "taxels": "wstac_msgs/msg/Taxels"}
    found = {}
    for kind, name in names.items():
        for payload, _, encoding in listener.messages[f"wstac/sensor/{kind}"]:
            same(encoding, f"application/cdr;{name}", f"encoding of {kind}")
            message = types.deserialize_cdr(payload, name)
            same(bytes(types.serialize_cdr(message, name)), payload, f"bytes of {kind}, written again")
            found.setdefault(kind, []).append(message)
    events = [record["frame"] for record in expected if record["kind"] == "event"]
    same([event.frame for event in found["event"]], events, "events in CDR")
    same([attachment for _, attachment, _ in listener.messages["wstac/sensor/event"]], [b"0", b"1", b"2"], "numbers of events")
    late = {str(sample.key_expr): (types.deserialize_cdr(sample.payload.to_bytes(), names["event"]).frame, str(sample.encoding)) for sample in kept}
    same(late, {f"wstac/sensor/event/{k}": (frame, f"application/cdr;{names['event']}") for k, frame in enumerate(events)}, "events for a late reader")
    same({encoding for _, _, encoding in listener.messages["wstac/sensor/end"]}, {"application/json"}, "encoding of the end")
    same(any(key.startswith("0/") for key in listener.messages), False, "topics of ROS 2 without --ros")
    listener.close()
    print(f"CDR: {sum(map(len, found.values()))} messages under the keys of JSON")
