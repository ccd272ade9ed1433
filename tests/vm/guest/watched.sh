# Runs the program under test and keeps everything it did; sourced by the guest's scripts.

# watched NAME COMMAND…: leaves NAME.out, NAME.err and NAME.exit in /out, and NAME.trace: every camera buffer that the kernel
# handed out meanwhile, with its sequence number. The trace is the truth that the program's own counting is held to.
watched() {
    local name=$1
    shift
    echo "$name" # on the console: how far the guest has come
    echo > /sys/kernel/tracing/trace
    timeout -s KILL 90 "$@" > "/out/$name.out" 2> "/out/$name.err"
    echo $? > "/out/$name.exit"
    grep "v4l2_dqbuf:.*VIDEO_CAPTURE" /sys/kernel/tracing/trace > "/out/$name.trace"
}
