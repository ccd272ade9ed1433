# The paths of all files. Every script here sources this file.
vm=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
repo=$(cd "$vm/../.." && pwd)
cache=${WSTAC_CACHE:-$repo/target}/vm
kernel=$cache/kernel # the unpacked kernel package
mkdir -p "$cache"
# Debian keeps depmod, modprobe and insmod in /sbin, which is not in the PATH of a plain user.
PATH=$PATH:/usr/sbin:/sbin
