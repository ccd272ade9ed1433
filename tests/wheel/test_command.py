"""Compares the package with the command: the same numbers, events and words."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac
from conftest import GLOBAL, LAWS, REPOSITORY, WSTAC, command, refusal


def check(source: str, found: wstac.Recording, *options: str) -> int:
    """Compares a recording with the output of `wstac run`. Returns the number of events."""
    lines = command("run", source, "--json", "--features", "--samples", "--model", "builtin:svm", *options)
    kinds: dict[str, list[Any]] = {kind: [line for line in lines if line["kind"] == kind] for kind in ("features", "event", "contact_end", "end")}
    assert found.feature_frames.tolist() == [line["frame"] for line in kinds["features"]]
    assert (found.features / 2048).tolist() == [line["f"] for line in kinds["features"]]
    assert found.features.dtype == np.int16
    for event, line in zip(found.events, kinds["event"]):
        assert (event.sample / 2048).tolist() == line.pop("sample")
        assert event.record == line
    assert len(found.events) == len(kinds["event"])
    assert [end.record for end in found.contact_ends] == kinds["contact_end"]
    [end] = kinds["end"]
    assert (found.end.frames, found.end.dropped, found.end.baseline) == (end["frames"], end["dropped"], end["baseline"])
    assert (found.end.dropped_by, found.end.readout_ms) == (end.get("dropped_by", {}), end.get("readout_ms", 0))
    return len(found.events)


def test_what_a_wave_tells_of_a_ball(tmp_path: Path) -> None:
    scene, config = tmp_path / "ball.toml", tmp_path / "wave.toml"
    scene.write_text('shape = "ball"\ndiameter = 15\nspeed = 100\ndirection = 30\n')
    config.write_text(GLOBAL)
    [event] = wstac.open(f"scene:{scene}", config=wstac.Config.read(config))
    lines = command("run", f"scene:{scene}", "--json", "--samples", "--model", "none", "--config", str(config))
    [line] = [line for line in lines if line["kind"] == "event"]
    del line["sample"]
    assert event.record == line
    [early] = wstac.open(f"scene:{scene}", config=wstac.Config.read(config), at_once=True)
    assert early.sample.shape == (10, 0) and early.completed_ns < event.completed_ns
    frames = wstac.simulate(scene).frames
    pipeline = wstac.Pipeline(fps=30, config=wstac.Config.read(config), at_once=True)
    [pushed] = [event for event in map(pipeline.push, frames) if event]
    assert pushed.sample.shape == (10, 0)
    assert (pushed.completed_ns, pushed.record) == (early.completed_ns, early.record)
    assert event.basis == "outline" and event.contacts == 1 and event.reliable
    row = event.to_dict()
    assert (row["place_mm"], row["place_sd_mm"]) == (line["place_mm"]["value"], line["place_mm"]["sd"])
    assert (row["width_mm"], row["width_sd_mm"]) == (line["width_mm"]["value"], line["width_mm"]["sd"])


def test_a_held_part_slips(tmp_path: Path) -> None:
    scene = tmp_path / "held.toml"
    scene.write_text('fidelity = "taxel"\n[[touch]]\nkind = "slide"\nspecimen = "Sin2"\nhold = 2\nspeed = 60\n')
    stream = wstac.open(f"scene:{scene}")
    [slip] = [record for record in stream.records() if isinstance(record, wstac.Slip)]
    assert [slip] == stream.slips == wstac.simulate(scene, frames=False).slips
    assert [slip.record] == [line for line in command("run", f"scene:{scene}", "--json") if line["kind"] == "slip"]
    assert slip.to_dict()["onset_frame"] == 105


@pytest.mark.parametrize("law", LAWS)
def test_a_recording(law: str, recording: Path, tmp_path: Path) -> None:
    config = tmp_path / "law.toml"
    config.write_text(LAWS[law])
    keys = wstac.Config.read(config)
    found = wstac.read(recording, config=keys, models="builtin:svm")
    assert check(str(recording), found, "--config", str(config)) >= 4
    # All that a law gives is there to be compared.
    without_speed = [event for event in found.events if event.speed is None]
    assert without_speed and all("speed" in event.why for event in without_speed)
    if law == "arrival":
        assert [event.contact for event in found.events] == ["slide", "slide", "slide", "press"]
        assert [end.event_frame for end in found.contact_ends] == [event.frame for event in found.events]
        assert any(event.end_frame is None for event in found.events) and any(event.end_frame for event in found.events)
        assert all(event.speed.sd and event.direction.sd for event in found.events[:3])
    else:
        assert any(event.speed_at_most for event in without_speed) and not found.contact_ends
        assert all(event.direction.confidence is not None and event.contact is None for event in found.events)
    assert found.labels == {"specimen": "Saw3", "who": "me"}
    assert found.frames is not None and found.frames.shape[1:] == (200, 200) and found.frames.dtype == np.uint8
    lost = sum(one.frames for one in found.lost)
    assert lost == found.end.dropped == sum(found.end.dropped_by.values()) > 0
    assert len(found.frames) == len(found.taxels) == len(found.frame_numbers) == found.end.frames - lost
    gaps = sorted(number for one in found.lost for number in range(one.at, one.at + one.frames))
    assert sorted([*found.frame_numbers.tolist(), *gaps]) == list(range(found.end.frames))
    # The other direction: its frames, as they arrived, through a pipeline.
    pipeline = wstac.Pipeline(fps=30, config=keys, models="builtin:svm")
    events, before = [], -1
    for number, frame, taxels in zip(found.frame_numbers, found.frames, found.taxels):
        events += [event for event in [pipeline.lose(int(number) - before - 1)] if event]
        events += [event for event in [pipeline.push(frame)] if event]
        assert np.array_equal(pipeline.taxels, taxels)
        before = int(number)
    assert events == found.events
    assert all(np.array_equal(one.sample, two.sample) for one, two in zip(events, found.events))
    assert pipeline.contact_ends == found.contact_ends
    without = wstac.read(recording, config=keys, models=[wstac.Model.load("builtin:svm")], frames=False)
    assert without.frames is None and without.events == events
    with wstac.open(recording, config=keys, models="builtin:svm") as stream:
        assert list(stream) == events and stream.end == found.end and stream.labels == found.labels
        assert stream.contact_ends == found.contact_ends
    with wstac.open(recording, config=keys) as stream:
        records = list(stream.records())
    assert [record for record in records if isinstance(record, wstac.ContactEnd)] == found.contact_ends
    assert [record.frame for record in records if isinstance(record, wstac.Event)] == [event.frame for event in events]
    assert records[-1] == found.end and len(records) == len(events) + len(found.contact_ends) + len(found.lost) + 1


def test_the_wall_clock_is_written_as_the_command_writes_it() -> None:
    [event] = wstac.simulate("Saw3@150", size=(80, 80)).events
    assert event.stamp is None and event.record["stamp"] is None
    stamped = replace(event, stamp=datetime(2026, 11, 22, 10, 0, 1, 500_999, tzinfo=timezone.utc), stamp_within_ms=0.5)
    assert stamped.record == {**event.record, "stamp": "2026-11-22T10:00:01.500Z", "stamp_within_ms": 0.5}
    end = replace(wstac.ContactEnd(75, 35, 2.5, 2_500_000_000), stamp=stamped.stamp, stamp_within_ms=0.5)
    assert end.record["stamp"] == "2026-11-22T10:00:01.500Z" and end.record["time_ns"] == 2_500_000_000


def test_frames_without_times_are_counted_from_0() -> None:
    found = wstac.simulate("Saw3@150", size=(80, 80), fps=25)
    assert found.end.clock == "frames" and found.end.time_ns == (found.end.frames - 1) * 40_000_000
    assert (found.timestamps == found.frame_numbers / 25).all()
    [event] = found.events
    assert event.touch_frame is not None and event.time_ns == event.touch_frame * 40_000_000


def test_what_nothing_states_is_a_note(tmp_path: Path) -> None:
    video = tmp_path / "slide.y4m"
    command("scene", "render", "Saw3@150", "-o", str(video))
    with wstac.open(video) as stream:
        layout, readout = stream.notes
    assert layout.startswith("no [layout] is given") and readout.startswith("readout unknown")
    assert wstac.read(video).end.readout_ms is None
    found = wstac.read(video, config={"sensor": {"readout_ms": 20}})
    assert found.notes == [layout] and found.end.readout_ms == 20
    check(str(video), wstac.read(video, models="builtin:svm"))
    with wstac.open("scene:Saw3@150") as scene:
        assert scene.notes == []


def test_data_sets(tmp_path: Path) -> None:
    for number, sweep in enumerate(
        (
            {"specimens": ["Saw3", "Fla0", "Tri2"], "speeds": [100, 150.5], "directions": [0, 90], "slides": 5, "seed": 3},
            {"specimens": ["Saw3"], "slides": 3, "scene": {"depth": 2.5, "sensor": {"dropped": 0.3}}},
        )
    ):
        head = [f"{key} = {value!r}" for key, value in sweep.items() if key != "scene"]
        scene = ["[scene]", "depth = 2.5", "[scene.sensor]", "dropped = 0.3"] if "scene" in sweep else []
        toml, npz = tmp_path / f"{number}.toml", tmp_path / f"{number}.npz"
        toml.write_text("\n".join(head + scene).replace("'", '"'))
        subprocess.run([WSTAC, "dataset", str(toml), "-o", str(npz)], check=True, capture_output=True)
        for made in (wstac.dataset(sweep, threads=2), wstac.dataset(toml)):
            with np.load(npz) as arrays:
                assert set(arrays) == set(made)
                for name in arrays:
                    assert made[name].dtype == arrays[name].dtype, name
                    assert np.array_equal(made[name], arrays[name]), name


def test_training_gets_the_commands_slides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(REPOSITORY / "tests" / "reference")
    from slides import Sweep, made

    toml, npz = tmp_path / "sweep.toml", tmp_path / "set.npz"
    toml.write_text('speeds = [100.0, 200.0]\ndirections = [90, 0]\nslides = 3\nseed = 9\n[scene]\nfidelity = "taxel"\n[scene.light]\nunit = 2\n')
    subprocess.run([WSTAC, "dataset", str(toml), "-o", str(npz)], check=True, capture_output=True)
    slides = made(Sweep(9, 3, [100, 200], [90, 0], unit=2))
    with np.load(npz) as arrays:
        assert np.array_equal(slides.x.reshape(-1, 10, 70), arrays["X"])
        assert np.array_equal(slides.specimen, arrays["y_specimen"]) and np.array_equal(slides.speed, arrays["speed"])
        assert np.array_equal(slides.direction, arrays["direction"]) and np.array_equal(slides.seed, arrays["seed"])


def test_refusals_have_the_commands_words(recording: Path, tmp_path: Path) -> None:
    bad, damaged = tmp_path / "bad.toml", tmp_path / "damaged.mcap"
    bad.write_text("[trigger]\nwindow = 0\n")
    damaged.write_bytes(recording.read_bytes()[:100_000])
    for source in ("nothing", "/dev/video99", "scene:Saw7@150", "scene:Saw3@0", str(bad), str(tmp_path), str(damaged)):
        with pytest.raises(wstac.Error) as refused:
            wstac.open(source)
        assert str(refused.value) == refusal("run", source)
    with pytest.raises(ValueError) as refused_value:
        wstac.Config.read(bad)
    assert str(refused_value.value) == refusal("run", "scene:Saw3@150", "--config", str(bad))
    for model in ("builtin:none", str(bad), "no.wsm"):
        with pytest.raises(wstac.Error) as refused:
            wstac.Model.load(model)
        assert str(refused.value) == refusal("run", "scene:Saw3@150", "--model", model)
    with pytest.raises(wstac.Error) as refused:
        wstac.open("scene:Saw3@150", models=["builtin:svm", "builtin:forest"])
    two = ["--model", "builtin:svm", "--model", "builtin:forest"]
    assert str(refused.value) == refusal("run", "scene:Saw3@150", *two)
    # A configuration file with corners outside the frame, and a sweep without slides.
    outside = tmp_path / "outside.toml"
    outside.write_text("[layout]\ntaxel = [9, 9]\ncorners = [" + "[9999, 0], " * 25 + "]\n")
    with pytest.raises(wstac.Error) as refused:
        wstac.simulate("Saw3@150", config=wstac.Config.read(outside))
    assert str(refused.value) == refusal("run", "scene:Saw3@150", "--config", str(outside))
    with pytest.raises(wstac.Error) as refused:
        wstac.dataset(bad)
    assert str(refused.value) == refusal("dataset", str(bad), "-o", str(tmp_path / "x.npz"))


def test_events_before_a_fault_in_the_file_are_given(tmp_path: Path) -> None:
    scene, clip = tmp_path / "scene.toml", tmp_path / "clip.y4m"
    scene.write_text('specimen = "Saw3"\nspeed = 150\n[sensor]\nsize = [80, 80]\n')
    command("scene", "render", str(scene), "-o", str(clip))
    clip.write_bytes(clip.read_bytes() + b"FRAMX\n")
    stream, events = wstac.open(clip), []
    with pytest.raises(wstac.Error, match="FRAM"):
        for event in stream:
            events.append(event)
    assert len(events) == 1 and stream.end is not None
    assert list(stream) == []


def test_one_sensor_of_a_recording_of_several(tmp_path: Path) -> None:
    both = tmp_path / "both.mcap"
    sources = {"left": "scene:Saw3@150", "right": "scene:Tri3@120,90deg"}
    cams = [f"cam:{name}={source}" for name, source in sources.items()]
    subprocess.run([WSTAC, "record", *cams, "-o", both], check=True, capture_output=True)
    for name, source in sources.items():
        [expected] = wstac.open(source, every=True)
        [event] = wstac.open(both, sensor=name)
        [gathered] = wstac.read(both, sensor=name, frames=False).events
        for found in (event, gathered):
            assert (found.speed, found.direction, found.touch_frame) == (expected.speed, expected.direction, expected.touch_frame)
    for read in (wstac.open, wstac.read):
        with pytest.raises(wstac.Error, match="has the sensors left, right, expected one of them"):
            read(both)
        with pytest.raises(wstac.Error, match='has no sensor "top", expected one of left, right'):
            read(both, sensor="top")
