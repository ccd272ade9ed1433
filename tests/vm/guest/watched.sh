# Runs the program under test and keeps all its results. The guest's scripts source this file.

# watched NAME COMMAND…: writes NAME.out, NAME.err and NAME.exit to /out. Also writes NAME.trace: every camera buffer
# that the kernel returned meanwhile, with its sequence number. The program's own counts are checked against this trace.
watched() {
    local name=$1
    shift
    echo "$name" # on the console: how far the guest has come
    echo > /sys/kernel/tracing/trace
    timeout -s KILL 900 "$@" > "/out/$name.out" 2> "/out/$name.err"
    echo $? > "/out/$name.exit"
    grep "v4l2_dqbuf:.*VIDEO_CAPTURE" /sys/kernel/tracing/trace > "/out/$name.trace"
}
