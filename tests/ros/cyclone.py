"""Hears the events of a sensor by CycloneDDS, without ROS: cyclone.py TOPIC

Prints each as JSON, until standard input ends. The types are those of wstac_msgs, by their names in DDS.
"""

import json
import sys
import threading
import time
from dataclasses import asdict, dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, annotations, types
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic


@dataclass
@annotations.final
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: types.int32
    nanosec: types.uint32


@dataclass
@annotations.final
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
@annotations.final
class Event(IdlStruct, typename="wstac_msgs.msg.dds_.Event_"):
    header: Header
    frame: types.uint64
    contact: str
    speed: types.float64
    speed_sd: types.float64
    direction: types.float64
    direction_sd: types.float64
    texture: str
    confidence: types.float64
    known: bool
    reliable: bool
    frames_filled: types.uint8
    basis: str
    contacts: types.uint8
    place: types.float64
    place_sd: types.float64
    width: types.float64
    width_sd: types.float64
    acceleration: types.float64
    acceleration_sd: types.float64
    period: types.float64
    period_sd: types.float64
    why: str


# As the node publishes them.
quality = Qos(Policy.Reliability.Reliable(0), Policy.Durability.TransientLocal, Policy.History.KeepLast(100))
reader = DataReader(participant := DomainParticipant(0), Topic(participant, sys.argv[1], Event), qos=quality)
is_over = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), is_over.set()), daemon=True).start()
while not is_over.is_set():
    for event in reader.take(100):
        # That the node has ended is no event.
        if isinstance(event, Event):
            print(json.dumps(asdict(event)), flush=True)
    time.sleep(0.02)
