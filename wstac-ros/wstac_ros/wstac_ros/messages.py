"""Records of the package wstac as messages: meters, radians and wall-clock times."""

from __future__ import annotations

import math
from datetime import datetime, timedelta, timezone

import numpy as np
import wstac
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from wstac_msgs.msg import ContactEnd, Event, Features, Slip, Taxels

EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
NAN = float("nan")


def time_of(stamp: datetime) -> Time:
    """Returns a wall-clock time as a message."""
    since = stamp - EPOCH
    return Time(sec=since.days * 86400 + since.seconds, nanosec=since.microseconds * 1000)


def name_of(texture: wstac.Texture) -> str:
    """Returns the specimen, or else what is known of it."""
    depth = "" if texture.depth_mm is None else f"{texture.depth_mm:g}"
    parts = " ".join(part for part in (texture.pattern, depth) if part)
    return texture.specimen or texture.class_ or parts


def event(found: wstac.Event, header: Header) -> Event:
    """Returns the message of an event."""
    texture = found.texture or wstac.Texture()

    def number(value: float | None, unit: float) -> float:
        return NAN if value is None else value * unit

    lengths: dict[str, float] = {}
    for name in ("place", "width", "period"):
        length: wstac.Measured | None = getattr(found, f"{name}_mm")
        lengths |= {name: number(length and length.value, 1e-3), f"{name}_sd": number(length and length.sd, 1e-3)}
    speed, direction, acceleration = found.speed, found.direction, found.acceleration
    return Event(
        header=header,
        frame=found.frame,
        contact=found.contact or "",
        speed=number(speed and speed.mm_s, 1e-3),
        speed_sd=number(speed and speed.sd, 1e-3),
        direction=number(direction and direction.deg, math.pi / 180),
        direction_sd=number(direction and direction.sd, math.pi / 180),
        texture=name_of(texture),
        confidence=number(texture.confidence, 1.0),
        known=texture.known is True,
        reliable=found.reliable,
        frames_filled=found.frames_filled,
        basis=found.basis or "",
        contacts=found.contacts or 0,
        acceleration=number(acceleration and acceleration.mm_s2, 1e-3),
        acceleration_sd=number(acceleration and acceleration.sd, 1e-3),
        why=found.why.get("reliable", ""),
        **lengths,
    )


def motion(found: wstac.Motion, header: Header) -> TwistStamped:
    """Returns the message of the motion in a frame, whose direction is known."""
    message = TwistStamped(header=header)
    angle = math.radians(found.direction.deg)
    message.twist.linear.x = found.speed.mm_s / 1000 * math.cos(angle)
    message.twist.linear.y = found.speed.mm_s / 1000 * math.sin(angle)
    return message


def contact_end(found: wstac.ContactEnd, header: Header) -> ContactEnd:
    """Returns the message of the end of a touch."""
    return ContactEnd(header=header, frame=found.frame, event_frame=found.event_frame)


def slip(found: wstac.Slip, header: Header) -> Slip:
    """Returns the message of a slip."""
    numbers = {name: getattr(found, name) for name in ("frame", "onset_frame", "held_since_frame", "strength")}
    return Slip(header=header, **numbers)


def features(number: int, values: np.ndarray, header: Header) -> Features:
    """Returns the message of a frame's features, which come in units of 1/2048."""
    return Features(header=header, frame=number, features=values.astype(np.float32) / np.float32(2048))


def taxels(number: int, sums: np.ndarray, header: Header) -> Taxels:
    """Returns the message of the taxel sums that a frame's features are made of."""
    return Taxels(header=header, frame=number, sums=sums.astype(np.uint32).ravel())


def picture(pixels: np.ndarray, stream: wstac.Stream, header: Header) -> Image | None:
    """Returns the message of a picture; None if it is too short. Of planes, only the first is in it."""
    (width, height), encoding = stream.size, stream.ros_encoding
    if pixels.ndim == 1:
        step = stream.bytes_per_row
        if step < width or len(pixels) < step * height:
            return None
        pixels = pixels[: step * height].reshape(height, step)
    data = np.ascontiguousarray(pixels)
    message = Image(header=header, height=height, width=width, encoding=encoding, step=data.nbytes // height)
    # An array of bytes is taken as it is; a list would be checked byte by byte.
    message.data.frombytes(data.tobytes())
    return message
