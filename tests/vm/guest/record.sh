# Tests recordings: of a camera that disappears for a moment, by a program that is killed, and to a disk that fills up.
# Also tests two cameras in one run.
. /guest/vivid.sh
. /guest/watched.sh
vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x0,0x0
# A still picture is a sensor that nothing touches. A moving picture is an event.
control test_pattern=4,horizontal_movement=3,vertical_movement=3,osd_text_mode=2
asked="--format GREY --size 320x180"
frame=57600

# grown FILE FRAMES: waits until a recording has the size of this many frames, for at most five minutes or until its program has
# ended. It has other records, too, and its last frame may be written in part.
grown() {
    local tries=0
    until [ "$(stat -c %s "$1" 2> /dev/null || echo 0)" -ge $(($2 * frame)) ] || [ -e "${1%.mcap}.exit" ] || [ $tries -ge 3000 ]; do
        usleep 100000
        tries=$((tries + 1))
    done
}

watched recorded wstac record /dev/video0 $asked --json -o /out/recorded.mcap --label specimen=Saw3 &
grown /out/recorded.mcap 60
control disconnect=1
grown /out/recorded.mcap 90
control horizontal_movement=6
grown /out/recorded.mcap 190
killall -TERM wstac
wait
control horizontal_movement=3

watched killed wstac record /dev/video0 $asked --json -o /out/killed.mcap &
# The size of 95 frames is more than 90 whole ones, which have to come back.
grown /out/killed.mcap 95
killall -KILL wstac
wait

# Two cameras in one recording.
watched both wstac record cam:left=/dev/video0 cam:right=/dev/video1 $asked --json -o /out/both.mcap &
grown /out/both.mcap 160
killall -TERM wstac
wait

mkdir /small
mount -t tmpfs -o size=4m small /small
watched full wstac record /dev/video0 $asked --json -o /small/full.mcap
cp /small/full.mcap /out

# One of two cameras disappears. The other must not be affected.
watched sensors wstac run cam:left=/dev/video0 cam:right=/dev/video1 --features --json $asked --frames 120 &
tries=0
until [ "$(grep -c left /out/sensors.out)" -ge 30 ] || [ $tries -ge 3000 ]; do usleep 100000; tries=$((tries + 1)); done
control disconnect=1
wait
