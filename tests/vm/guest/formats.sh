# Captures every pixel format from a webcam: two moving pictures with features and raw buffers, and a still picture that
# v4l2-ctl reads too.
. /guest/vivid.sh
. /guest/watched.sh
vivid node_types=0x1 num_inputs=1 input_types=0
v4l2-ctl -d /dev/video0 --list-formats > /out/offered

# Squares of full colors differ in every taxel and clip. Red and green pixels side by side reveal a Bayer site or a
# chroma sample of a neighbor.
moving='horizontal_movement=6,vertical_movement=5,osd_text_mode=0'
still='horizontal_movement=3,vertical_movement=3,osd_text_mode=2'

grep -v '^#' /guest/formats.list | while read -r name fourcc colorimetry; do
    fourcc=$(printf '%-4s' "$fourcc")
    # The colorimetry of one format must not affect the next.
    control "colorspace=2,y_cbcr_encoding=0,quantization=0"
    [ -z "$colorimetry" ] || control "$colorimetry"
    capture() {
        watched "$name-$1" wstac run /dev/video0 --features --json --format "$fourcc" --size 640x360 \
            --frames 5 --save-raw "/out/$name-$1.raw" < /dev/null
    }
    control "test_pattern=4,$moving"
    capture squares
    v4l2-ctl -d /dev/video0 --get-fmt-video > "/out/$name.format"
    control "test_pattern=14"
    capture checkers
    control "test_pattern=2,$still"
    capture still
    v4l2-ctl -d /dev/video0 --set-fmt-video="width=640,height=360,pixelformat=$fourcc" \
        --stream-mmap --stream-count=1 --stream-to="/out/$name-v4l2.raw" > "/out/$name-v4l2.log" 2>&1
done
