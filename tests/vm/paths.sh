# Where everything is; sourced by every script here.
vm=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
repo=$(cd "$vm/../.." && pwd)
cache=${WSTAC_CACHE:-$repo/target}/vm
kernel=$cache/kernel # the unpacked kernel package
mkdir -p "$cache"
# Debian keeps depmod, modprobe and insmod in /sbin, which a plain user's PATH lacks.
PATH=$PATH:/usr/sbin:/sbin
