"""Opens recordings with tools of others, and compares what they see with what `wstac run` prints.

The mcap reader of PyPI decodes every message by the schemas in the file. Rerun's converter turns the file into what its
viewer shows: pictures, plots and text.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import schemas
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as Protobuf
from mcap_ros2.decoder import DecoderFactory as Ros2

WSTAC = os.environ["WSTAC"]
RERUN = Path(sys.executable).parent / "rerun"
# A format, its encoding for viewers, and the picture that they decode.
FORMATS = {
    "GREY": ("mono8", 400, 400),
    "YUYV": ("yuyv", 400, 400),
    "RGB3": ("rgb8", 400, 400),
    "RGGB": ("bayer_rggb8", 400, 400),
    "Y16": ("mono16", 400, 400),
    "Y10": ("mono16", 400, 400),
    "NV12": ("mono8", 400, 600),
    "MJPG": ("jpeg", 400, 400),
}


def wstac(*arguments):
    return subprocess.run([WSTAC, *arguments], check=True, capture_output=True, text=True).stdout.splitlines()


def record(folder, fourcc):
    """Records a slide that loses frames. Returns its scene and its file."""
    scene = folder / f"{fourcc}.toml"
    scene.write_text(
        f'specimen = "Saw3"\nspeed = 150\nseed = 5\n[sensor]\nsize = [400, 400]\nformat = "{fourcc}"\ndropped = 0.03\n'
    )
    file = folder / f"{fourcc}.mcap"
    lines = wstac("record", f"scene:{scene}", "-o", str(file), "--json", "--label", "specimen=Saw3")
    return scene, file, lines


def decoded(file):
    """Returns the messages by topic, with their times and contents."""
    topics = {}
    with open(file, "rb") as opened:
        reader = make_reader(opened, validate_crcs=True, decoder_factories=[Protobuf(), Ros2()])
        for schema, channel, message in reader.iter_messages():
            found = topics.setdefault(channel.topic, [])
            if channel.message_encoding == "json":
                found.append((message, json.loads(message.data)))
            else:
                decoder = next(d for d in (f.decoder_for(channel.message_encoding, schema) for f in (Protobuf(), Ros2())) if d)
                found.append((message, decoder(message.data)))
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        statistics = reader.get_summary().statistics
    return topics, metadata, statistics


def check_messages(fourcc, file, scene, lines):
    """Checks everything in the file, decoded by its own schemas."""
    topics, metadata, statistics = decoded(file)
    features = [json.loads(line)["f"] for line in wstac("run", f"scene:{scene}", "--json", "--features") if '"f":' in line]
    assert [list(array.data) for _, array in topics["/features"]] == features, fourcc
    assert [said for _, said in topics["/events/json"]] == [json.loads(line) for line in lines], fourcc
    assert len(topics["/events"]) == len(lines)
    assert topics["/events"][0][1].message.startswith("event at frame "), topics["/events"][0]
    end = json.loads(lines[-1])
    lost = [said for _, said in topics["/faults/json"]]
    assert end["dropped"] == sum(said["frames"] for said in lost) > 0
    assert all(said["kind"] == "lost" for said in lost)
    frames = topics["/camera"]
    assert len(frames) == len(topics["/taxels"]) == end["frames"] - end["dropped"]
    encoding, width, height = FORMATS[fourcc]
    for message, image in frames:
        # In a file, the time of a frame follows from its number.
        assert message.log_time == message.sequence * 1_000_000_000 // 30
        assert image.timestamp.seconds * 10**9 + image.timestamp.nanos == message.log_time
        if encoding == "jpeg":
            assert image.format == "jpeg" and image.data[:2] == b"\xff\xd8"
        else:
            assert (image.encoding, image.width, image.height) == (encoding, width, height), fourcc
            assert len(image.data) == image.step * image.height
    for _, image in topics["/taxels"]:
        assert (image.encoding, image.width, image.height, len(image.data)) == ("32FC1", 5, 5, 100)
    assert metadata["wstac.labels"] == {"specimen": "Saw3"}
    assert "floor_levels = 0.5" in metadata["wstac.configuration"]["toml"]
    assert json.loads(metadata["wstac.layout"]["json"])["frame"] == [400, 400]
    assert json.loads(metadata["wstac.stream"]["json"])["rate"] == [30, 1]
    assert statistics.message_count == sum(map(len, topics.values()))
    return statistics.message_count


def check_two(folder):
    """Checks a recording of two sensors: topics, messages, and what the schema and the layout of one sensor say of them."""
    file, sensors = folder / "both.mcap", {"left": "GREY", "right": "YUYV"}
    sources = [f"cam:{name}=scene:{folder / f'{fourcc}.toml'}" for name, fourcc in sensors.items()]
    lines = [json.loads(line) for line in wstac("record", *sources, "-o", str(file), "--json")]
    topics, metadata, statistics = decoded(file)
    assert json.loads(metadata["wstac.sensors"]["json"]) == list(sensors), metadata.keys()
    kinds = ("camera", "taxels", "features", "events", "events/json", "faults", "faults/json")
    assert set(topics) == {f"/{name}/{kind}" for name in sensors for kind in kinds} | {"/sums/json"}, set(topics)
    for name, fourcc in sensors.items():
        said = [said for _, said in topics[f"/{name}/events/json"]]
        own = [{key: value for key, value in line.items() if key != "sensor"} for line in lines if line["sensor"] == name]
        assert said == own and said[-1]["kind"] == "end", (said, own)
        frames = topics[f"/{name}/camera"]
        assert len(frames) == len(topics[f"/{name}/taxels"]) == said[-1]["frames"] - said[-1]["dropped"]
        assert {image.encoding for _, image in frames} == {FORMATS[fourcc][0]}
        panels = schemas.check_layout(file, f"/{name}")
    assert statistics.message_count == sum(map(len, topics.values()))
    valid = schemas.check_recording(file)
    print(f"ok: two sensors in one file: {valid} messages of JSON are valid, and {panels} panels show topics of each")


def check_rerun(fourcc, file, folder):
    """Checks what Rerun's viewer would show."""
    shown = folder / f"{fourcc}.rrd"
    subprocess.run([RERUN, "mcap", "convert", str(file), "-o", str(shown)], check=True, capture_output=True)
    printed = subprocess.run([RERUN, "rrd", "print", str(shown)], check=True, capture_output=True, text=True).stdout
    rows = Counter()
    for line in printed.splitlines():
        if not line.startswith("Chunk("):
            continue
        entity, columns = line.split(" - ")[1], line.split("data columns: ")[1]
        for archetype in ("EncodedImage:blob", "Image:buffer", "Scalars:scalars", "TextLog:text"):
            if archetype in columns:
                rows[entity, archetype] += int(line.split(" with ")[1].split(" rows")[0])
    topics, _, _ = decoded(file)
    picture = "EncodedImage:blob" if fourcc == "MJPG" else "Image:buffer"
    for topic, archetype in [
        ("/camera", picture),
        ("/taxels", "Image:buffer"),
        ("/features", "Scalars:scalars"),
        ("/events", "TextLog:text"),
        ("/faults", "TextLog:text"),
    ]:
        assert rows[topic, archetype] == len(topics.get(topic, [])), (fourcc, topic, archetype, rows)
    return dict(rows)


def other_lines(folder):
    """Returns lines of all kinds that streams have, and of events of every law, with and without answers."""
    published = folder / "published.toml"
    published.write_text('[speed]\nlaw = "published"\n')
    ball = folder / "ball.toml"
    ball.write_text('shape = "ball"\ndiameter = 15\nspeed = 100\ndirection = 30\n')
    # Most frames are lost: samples are interrupted.
    gaps = folder / "gaps.toml"
    gaps.write_text('specimen = "Fla0"\nspeed = 150\nseed = 1\n[sensor]\ndropped = 0.75\n')
    every = ["--json", "--features", "--motion", "--samples"]
    for source, more in [
        ("scene:Saw3@150,30deg", []),
        ("scene:Saw3@150,30deg", ["--model", "builtin:path-svm"]),
        ("scene:Saw3@150", ["--config", str(published)]),
        ("scene:Saw3@150", ["--config", str(published), "--model", "builtin:svm-20f"]),
        ("scene:Saw3@20", ["--config", str(published)]),
        ("scene:Saw3@20", []),
        (f"scene:{gaps}", []),
        (f"scene:{ball}", []),
    ]:
        yield wstac("run", source, *every, *more)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for fourcc in FORMATS:
            scene, file, lines = record(folder, fourcc)
            count = check_messages(fourcc, file, scene, lines)
            rows = check_rerun(fourcc, file, folder)
            shown = ", ".join(f"{topic} {rows[topic, kind]} × {kind.split(':')[0]}" for topic, kind in sorted(rows))
            valid = schemas.check_recording(file)
            print(f"ok: {fourcc}: {valid} messages of JSON are valid by the schema in the file")
            print(f"ok: {fourcc}: {count} messages decoded; Rerun shows {shown}")
            # The recovered half of a file opens, too.
            half = folder / "half.mcap"
            half.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
            whole = folder / "whole.mcap"
            wstac("recover", str(half), "-o", str(whole), "--force")
            frames = len(decoded(whole)[0]["/camera"])
            assert 40 < frames < 100, frames
            check_rerun(fourcc, whole, folder)
            print(f"ok: {fourcc}: half of the file, recovered: {frames} frames")
        check_two(folder)
        print(f"ok: the layout for Foxglove: {schemas.check_layout(file)} panels of topics that are there")
        kinds = schemas.check_lines(file, other_lines(folder))
        assert set(kinds) >= {"contact_end", "end", "event", "features", "incomplete", "motion", "texture"}, kinds
        print(f"ok: lines of wstac run --json are valid by the same schema: {', '.join(kinds)}")
    print("viewers: recordings open")


if __name__ == "__main__":
    main()
