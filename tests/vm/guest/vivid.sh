# Loads vivid with the parameters given and waits for its nodes; sourced by the guest's scripts.
# Debian's vivid pulls in modules that the boot list may have loaded already, hence the test.
vivid() {
    while read -r ko; do
        name=$(basename "$ko" .ko | tr - _)
        [ -d "/sys/module/$name" ] && continue
        case $name in
            vivid) insmod "/modules/$ko" n_devs=1 "$@" || return 1 ;;
            *) insmod "/modules/$ko" || return 1 ;;
        esac
    done < /modules/vivid
    [ -e /dev/video0 ]
}
