# A camera that misbehaves, and a user who stops it.
. /guest/vivid.sh
. /guest/watched.sh
# With an output node beside the camera, which must not be taken for one.
vivid node_types=0x101 num_inputs=1 input_types=0 num_outputs=1 output_types=1
# The picture does not matter here; small frames leave the processor to the faults.
run="wstac run /dev/video0 --features --json --format GREY --size 320x180"
press() { control "$1=1"; }

watched devices wstac devices

control percentage_of_dropped_buffers=30
watched dropped $run --frames 90 --save-raw /out/dropped.raw
# vivid then starts at 2^32 - 128, so the count wraps within this run.
control wrap_sequence_number=1
watched wrapped $run --frames 160 --save-raw /out/wrapped.raw
control wrap_sequence_number=0,percentage_of_dropped_buffers=0

(for _ in 1 2 3 4 5; do usleep 300000; press inject_v4l2_buf_flag_error; done) &
watched flagged $run --frames 60 --save-raw /out/flagged.raw
wait

# vivid's webcam offers fewer rates the larger the picture is: 30 frames a second is refused here.
watched slow wstac run /dev/video0 --features --json --format GREY --size 1920x1080 --frames 8
v4l2-ctl -d /dev/video0 --get-parm > /out/slow.format

watched interrupted timeout -s INT 3 $run --save-raw /out/interrupted.raw
watched terminated timeout -s TERM 3 $run --save-raw /out/terminated.raw

press inject_vidioc_streamon_error
watched streamon $run --frames 5
press inject_vidioc_reqbufs_error
watched reqbufs $run --frames 5
(sleep 1; press inject_vidioc_qbuf_error) &
watched qbuf timeout -s INT 4 $run
wait
(sleep 1; press inject_fatal_streaming_error) &
watched fatal timeout -s INT 4 $run
wait
(sleep 1; press disconnect) &
watched disconnected timeout -s INT 4 $run
wait
