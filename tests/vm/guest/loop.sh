# Plays the frames on /dev/vdb to vivid's output, which loops them back to its HDMI input, where wstac reads them.
. /guest/vivid.sh
. /guest/watched.sh
vivid node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1

# The 720p timings at 30 frames per second. The default is 60.
index=$(v4l2-ctl -d /dev/video0 --list-dv-timings | awk '
    /Index:/ { i = $2 } /Active width:/ { w = $3 } /Active height:/ { h = $3 }
    /Pixelclock:/ && w == 1280 && h == 720 && /\(30\.00 / { print i; exit }')
for n in 0 1; do
    v4l2-ctl -d /dev/video$n --set-dv-bt-timings index="$index" || exit 98
done
# Only if size and format are equal on both sides, frames are looped pixel for pixel. Otherwise they are scaled or
# replaced by a test pattern.
v4l2-ctl -d /dev/video1 --set-fmt-video-out=width=1280,height=720,pixelformat=GREY || exit 98
v4l2-ctl -d /dev/video0 --set-fmt-video=width=1280,height=720,pixelformat=GREY || exit 98
control loop_video=1,osd_text_mode=2

# More than four output buffers are refused with EINVAL.
v4l2-ctl -d /dev/video1 --stream-out-mmap=4 --stream-from /dev/vdb --verbose > /out/play 2>&1 &
until grep -q 'out dqbuf' /out/play; do usleep 20000; done
watched loop wstac run /dev/video0 --features --json --format GREY --size 1280x720 --frames 150 --save-raw /out/loop.raw
v4l2-ctl -d /dev/video0 --get-fmt-video --get-parm > /out/loop.format
kill %1
