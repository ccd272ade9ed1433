# Reads a USB camera through the kernel's uvcvideo, in both of its formats.
. /guest/watched.sh
while read -r ko; do insmod "/modules/$ko" || exit 97; done < /modules/usb
for _ in $(seq 100); do [ -e /dev/video0 ] && break; usleep 100000; done
[ -e /dev/video0 ] || exit 97
mount -t tracefs trace /sys/kernel/tracing
echo 1 > /sys/kernel/tracing/events/v4l2/v4l2_dqbuf/enable || exit 97
v4l2-ctl -d /dev/video0 --list-formats-ext > /out/offered
for format in GREY MJPG; do
    watched $format wstac run /dev/video0 --format $format --size 320x240 --features --json --frames 140 --save-raw /out/$format.raw
done
