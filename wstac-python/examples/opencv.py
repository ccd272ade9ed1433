"""Prints the tactile events of what OpenCV reads.

    python opencv.py SOURCE [READOUT_MS]

SOURCE is a video file, or the number of a camera, such as 0. READOUT_MS is the time in which the camera reads its rows,
0 for a global shutter; without it, fast slides are not reliable.

OpenCV (pip install opencv-python-headless) does not lock a camera's exposure, gain and white balance, and does not
report lost frames: wstac.open("/dev/video0") does both.
"""

import sys

import cv2
import numpy as np
import wstac

source = sys.argv[1]
capture = cv2.VideoCapture(int(source) if source.isdecimal() else source)
config = {"sensor": {"readout_ms": float(sys.argv[2])}} if len(sys.argv) > 2 else None
pipeline = wstac.Pipeline(fps=capture.get(cv2.CAP_PROP_FPS), config=config)
while True:
    found, frame = capture.read()
    if not found:
        break
    # Blue, green, red: (height, width, 3). OpenCV's types do not say that it is uint8.
    event = pipeline.push(np.asarray(frame, np.uint8))
    if event is not None and event.speed is not None and event.direction is not None:
        print(f"{event.time_s} s: {event.contact}, {event.speed.mm_s} mm/s, {event.direction.deg} degrees")
