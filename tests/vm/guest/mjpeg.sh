# Reads MJPEG from a USB camera through the kernel's uvcvideo.
. /guest/watched.sh
while read -r ko; do insmod "/modules/$ko" || exit 97; done < /modules/usb
for _ in $(seq 100); do [ -e /dev/video0 ] && break; usleep 100000; done
[ -e /dev/video0 ] || exit 97
mount -t tracefs trace /sys/kernel/tracing
echo 1 > /sys/kernel/tracing/events/v4l2/v4l2_dqbuf/enable || exit 97
watched mjpeg wstac run /dev/video0 --format MJPG --size 320x240 --features --json --frames 200
