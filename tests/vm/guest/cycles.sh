# Opens, loses and finds a camera a thousand times.
. /guest/vivid.sh
vivid node_types=0x1 num_inputs=1 input_types=0
button() { v4l2-ctl -d /dev/video0 --list-ctrls | awk -v name="$1" '$1 == name { print name "=" $2 }'; }
camera_cycles /dev/video0 1000 "$(button inject_fatal_streaming_error)" "$(button disconnect)" > /out/cycles 2>&1
