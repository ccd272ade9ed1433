# Functions that install Debian packages. Other scripts read them in with `.`.

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"
    elif command -v sudo > /dev/null; then sudo "$@"
    else echo "setup: \"$*\" needs root or sudo, found neither" >&2; return 1
    fi
}

# Another apt may hold the lock: waits for it instead of failing.
apt() {
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=600 "$@"
}

# install WHAT-FOR PACKAGE…: those that are missing.
install() {
    local for=$1 missing=()
    shift
    command -v dpkg-query > /dev/null || { echo "setup: no Debian packages here; install for $for: $*" >&2; return 0; }
    for package in "$@"; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2> /dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} = 0 ] && return 0
    echo "setup: installing for $for: ${missing[*]}" >&2
    # Lists may be missing or older than the archive. Only then are new ones downloaded.
    apt install -y --no-install-recommends -s "${missing[@]}" > /dev/null 2>&1 || apt update > /dev/null
    # A package from another archive can be in conflict. It is never removed without a message.
    apt install -y --no-install-recommends -s "${missing[@]}" | sed -n 's/^Remv \([^ ]*\) .*/setup: apt will remove \1/p' >&2
    apt install -y --no-install-recommends "${missing[@]}" > /dev/null 2>&1 || {
        apt update > /dev/null
        apt install -y --no-install-recommends "${missing[@]}" > /dev/null
    }
}
