# Tests controls that are locked, controls that drift, and the report of `wstac doctor` about both.
. /guest/vivid.sh
. /guest/watched.sh
vivid node_types=0x1 num_inputs=1 input_types=0
# With small frames that do not move, vivid is a sensor that nothing touches.
control test_pattern=2,horizontal_movement=3,vertical_movement=3,osd_text_mode=2
asked="--format GREY --size 320x180"
doctor="wstac doctor /dev/video0 $asked --json"

v4l2-ctl -d /dev/video0 --list-ctrls > /out/controls.before
v4l2-ctl -d /dev/video0 --list-formats > /out/offered

# vivid changes the gain every second while its automatic gain is on.
control gain_automatic=1
watched drifting $doctor --seconds 3 --keep-controls
v4l2-ctl -d /dev/video0 --get-ctrl gain_automatic > /out/drifting.controls

control gain_automatic=1
watched locked $doctor --seconds 3
v4l2-ctl -d /dev/video0 --get-ctrl gain_automatic,gain > /out/locked.controls

control gain_automatic=1
watched set $doctor --seconds 1 --control gain=77 --control brightness=140
v4l2-ctl -d /dev/video0 --get-ctrl gain_automatic,gain,brightness > /out/set.controls

watched unknown $doctor --control exposure=1
watched range $doctor --control gain=1000
watched text wstac doctor /dev/video0 $asked --seconds 1

# Runs wstac run with the same camera, to see the state that is recorded with it.
control gain_automatic=1
watched run wstac run /dev/video0 $asked --json --frames 30
v4l2-ctl -d /dev/video0 --get-ctrl gain_automatic > /out/run.controls

# A third of the frames never arrive, but the camera keeps its rate.
control percentage_of_dropped_buffers=30
watched dropped $doctor --seconds 5
