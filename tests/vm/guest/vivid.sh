# Functions that load and control vivid. The guest's scripts source this file.

# vivid PARAMETER…: loads the driver and its dependencies, and waits for /dev/video0.
vivid() {
    while read -r ko; do
        case $ko in
            vivid.ko) insmod /modules/vivid.ko n_devs=1 "$@" || exit 97 ;;
            # A script before this one has loaded it in the same boot.
            *) grep -q "^$(echo "${ko%.ko}" | tr - _) " /proc/modules || insmod "/modules/$ko" || exit 97 ;;
        esac
    done < /modules/vivid
    [ -e /dev/video0 ] || exit 97
    [ -e /sys/kernel/tracing/trace ] || mount -t tracefs trace /sys/kernel/tracing
    echo 1 > /sys/kernel/tracing/events/v4l2/v4l2_dqbuf/enable || exit 97
}

# control NAME=VALUE,…: sets controls of the capture node.
control() {
    v4l2-ctl -d /dev/video0 --set-ctrl "$1" || exit 98
}
