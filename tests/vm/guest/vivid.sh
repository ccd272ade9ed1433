# Loading and driving vivid; sourced by the guest's scripts.

# vivid PARAMETER…: loads the driver and what it needs, and waits for /dev/video0.
vivid() {
    while read -r ko; do
        case $ko in
            vivid.ko) insmod /modules/vivid.ko n_devs=1 "$@" || exit 97 ;;
            # A script before this one in the same boot has loaded it.
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
