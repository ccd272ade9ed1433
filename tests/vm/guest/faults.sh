# Tests a camera with faults, and a user who stops the program. There are two vivid cameras. The webcam input of the
# first one is tested. It also has an output node that must not be taken for a camera, and a second input that can lose
# its signal. The other camera later takes the first one's place.
. /guest/vivid.sh
. /guest/watched.sh
cameras="n_devs=2 node_types=0x101,0x1 num_inputs=2,1 input_types=0xc,0x0 num_outputs=1,1 output_types=1,1"
vivid $cameras
# The picture does not matter here. Small frames leave processor time for the faults.
run="wstac run /dev/video0 --features --json --format GREY --size 320x180"
press() { control "$1=1"; }
lines() { wc -l < "/out/$1.out"; }

# begun NAME LINES: waits until a run has printed this many lines, for at most half a minute.
begun() {
    local tries=0
    until [ -e "/out/$1.out" ] && [ "$(lines "$1")" -ge "$2" ] || [ $tries -ge 300 ]; do
        usleep 100000
        tries=$((tries + 1))
    done
}

# faulty NAME FAULT…: causes a fault during a run, which continues for some time and is then stopped.
faulty() {
    local name=$1
    shift
    watched "$name" $run --save-raw "/out/$name.raw" &
    begun "$name" 30
    "$@"
    begun "$name" $(($(lines "$name") + 45))
    killall -TERM wstac
    wait
}

# Both cameras disappear and come back together.
unplug() { echo vivid.0 > /sys/bus/platform/drivers/vivid/unbind; }
plug() { echo vivid.0 > /sys/bus/platform/drivers/vivid/bind; }

watched devices wstac devices

for percent in 1 30 90; do
    control percentage_of_dropped_buffers=$percent
    watched dropped-$percent $run --frames 300 --save-raw /out/dropped-$percent.raw
done
control percentage_of_dropped_buffers=30
# vivid then starts at 2^32 - 128, so the count wraps during this run.
control wrap_sequence_number=1
watched wrapped $run --frames 160 --save-raw /out/wrapped.raw
control wrap_sequence_number=0,percentage_of_dropped_buffers=0
# The nanoseconds since the start pass 2^63 sixteen seconds after the stream starts.
control wrap_timestamp=1
watched timewrap $run --frames 560 --save-raw /out/timewrap.raw
control wrap_timestamp=0

flag() { for _ in 1 2 3 4 5; do press inject_v4l2_buf_flag_error; usleep 300000; done; }
faulty flagged flag

# vivid's webcam has fewer rates for larger pictures. 30 frames per second is refused here.
watched slow wstac run /dev/video0 --features --json --format GREY --size 1920x1080 --frames 8
v4l2-ctl -d /dev/video0 --get-parm > /out/slow.format
# Another program sets the rate of the running stream.
rate() { v4l2-ctl -d /dev/video0 --set-parm "$1" > /dev/null; }
slower() { rate 10; begun slower $(($(lines slower) + 120)); rate 30; begun slower $(($(lines slower) + 100)); }
faulty slower slower

# stopped NAME SIGNAL: a user stops a run.
stopped() {
    watched "$1" $run --save-raw "/out/$1.raw" &
    begun "$1" 40
    killall "-$2" wstac
    wait
}
stopped interrupted HUP
stopped terminated TERM

# The program itself is stopped for some time, so that buffers pile up. Without --save-raw, only the newest one is used.
watched newest $run &
begun newest 30
killall -STOP wstac
sleep 1
killall -CONT wstac
begun newest $(($(lines newest) + 40))
killall -TERM wstac
wait

press inject_vidioc_streamon_error
watched streamon $run --frames 5
press inject_vidioc_reqbufs_error
watched reqbufs $run --frames 5
faulty qbuf press inject_vidioc_qbuf_error
faulty fatal press inject_fatal_streaming_error
# The stream fails, and starting it again first fails in every possible way.
stubborn() { control inject_vidioc_streamon_error=1,inject_vidioc_reqbufs_error=1,inject_vidioc_qbuf_error=1,inject_fatal_streaming_error=1; }
faulty restart stubborn
faulty disconnected press disconnect

again() { unplug; sleep 2; plug; }
faulty unplugged again

# Loads the driver again with other numbers, so that the other camera is /dev/video0.
loaded() {
    # A program that looks for a camera sometimes has it open.
    for _ in $(seq 100); do rmmod vivid 2> /dev/null && break; usleep 100000; done
    insmod /modules/vivid.ko $cameras vid_cap_nr="$1"
}
replaced() { unplug; sleep 1; loaded 2,0; }
faulty replaced replaced
loaded 0,2

# The link by serial number leads to the camera's new number. Elsewhere, udev creates it.
link() { ln -sfn "../../$1" /dev/v4l/by-id/usb-vivid_1234-video-index0; }
mkdir -p /dev/v4l/by-id
link video0
moved() {
    exec 9<> /dev/video0 # keeps the old number taken
    unplug
    sleep 1
    plug
    for node in /sys/class/video4linux/video*; do
        case $(cat "$node/name") in vivid-000-vid-cap) link "${node##*/}" ;; esac
    done
}
faulty moved moved
exec 9>&-
rm -r /dev/v4l
loaded 0,2

# The 720p timings at 30 frames per second. The default is 60.
v4l2-ctl -d /dev/video0 --set-input=1 > /dev/null
index=$(v4l2-ctl -d /dev/video0 --list-dv-timings | awk '
    /Index:/ { i = $2 } /Active width:/ { w = $3 } /Active height:/ { h = $3 }
    /Pixelclock:/ && w == 1280 && h == 720 && /\(30\.00 / { print i; exit }')
v4l2-ctl -d /dev/video0 --set-dv-bt-timings index="$index" > /dev/null
signal() { control dv_timings_signal_mode=1; sleep 2; control dv_timings_signal_mode=0; }
faulty signal signal
# The rate of television: one frame in a thousand fewer.
control reduced_framerate=1
watched reduced $run --frames 120 --save-raw /out/reduced.raw
