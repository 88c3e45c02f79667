#!/usr/bin/env bash
# Runs the tests that need a CAN interface in a virtual machine that has one: Debian's kernel and vcan0.
#
#     tests/socketcan/run.sh FOLDER
#
# FOLDER caches the kernel between runs. Exit code 77: a requirement is missing, named in the last line. The
# machine is emulated instruction by instruction: its clock advances one nanosecond per instruction and skips
# idle time, so that timing inside it does not depend on the speed of the host.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=$1
root=$folder/root
console=$folder/console.log
modules=(can can-raw can-dev vcan)
tests=(conformance overrun socketcan)

lacks() {
    echo "$*"
    exit 77
}

# Unpacks the kernel of Debian's metapackage: kernel/vmlinuz and the modules.
fetch_kernel() {
    local package
    package=$(apt-cache depends linux-image-amd64 2>/dev/null |
        sed -n 's/^ *|\?Depends: \(linux-image-[0-9].*-amd64\)$/\1/p' | head -n 1)
    [[ -n $package ]] || return 1
    [[ $(cat "$folder/kernel/package" 2>/dev/null) != "$package" ]] || return 0
    echo "fetching $package"
    rm -rf "$folder/download"
    mkdir -p "$folder/download"
    (cd "$folder/download" && apt-get download "$package") >"$folder/apt.log" 2>&1 || return 1
    rm -rf "$folder/kernel"
    mkdir -p "$folder/kernel"
    dpkg-deb --extract "$folder"/download/*.deb "$folder/download/files"
    cp "$folder"/download/files/boot/vmlinuz-* "$folder/kernel/vmlinuz"
    local module found
    for module in "${modules[@]}"; do
        found=$(find "$folder/download/files" -name "$module.ko*")
        case $found in
        *.ko) cp "$found" "$folder/kernel/$module.ko" ;;
        *.ko.xz) xz --decompress --stdout "$found" >"$folder/kernel/$module.ko" ;;
        *) lacks "$package has no module $module that can be read" ;;
        esac
    done
    echo "$package" >"$folder/kernel/package"
    rm -rf "$folder/download"
}

# Installs a program with its shared libraries.
install_program() {
    cp "$1" "$root/bin/$2"
    local library
    for library in $(ldd "$1" 2>/dev/null | grep -o '/[^ ]*' || true); do
        mkdir -p "$root$(dirname "$library")"
        cp -L "$library" "$root$library"
    done
}

for command in qemu-system-x86_64 busybox cpio apt-cache apt-get dpkg-deb; do
    command -v $command >/dev/null || lacks "needs the command $command"
done
mkdir -p "$folder"
if ! fetch_kernel && ! { [[ $(id -u) == 0 ]] && apt-get update >"$folder/apt.log" 2>&1 && fetch_kernel; }; then
    [[ -f $folder/kernel/package ]] || lacks "Debian's package linux-image-amd64 is out of reach"
fi

rm -rf "$root"
mkdir -p "$root"/{bin,proc,sys,dev,tmp,modules}
selection=()
for test in "${tests[@]}"; do
    selection+=(--test "$test")
done
cargo test --locked --workspace --exclude supple-python "${selection[@]}" --no-run 2>"$folder/cargo.log" || {
    cat "$folder/cargo.log"
    exit 1
}
for test in "${tests[@]}"; do
    program=$(sed -n "s/^ *Executable tests\/$test\(\/main\)\?\.rs (\(.*\))$/\2/p" "$folder/cargo.log")
    install_program "$program" "$test"
done
install_program "$(command -v busybox)" busybox
for module in "${modules[@]}"; do
    cp "$folder/kernel/$module.ko" "$root/modules/"
done

# The driver echoes each sent frame, as the drivers of real cards do.
cat >"$root/init" <<END
#!/bin/busybox sh
busybox=/bin/busybox
\$busybox mount -t proc proc /proc
\$busybox mount -t sysfs sys /sys
\$busybox mount -t devtmpfs dev /dev
\$busybox insmod /modules/can.ko
\$busybox insmod /modules/can-raw.ko
\$busybox insmod /modules/can-dev.ko
\$busybox insmod /modules/vcan.ko echo=1
\$busybox ip link add dev vcan0 type vcan
\$busybox ip link set vcan0 up
export SUPPLE_CAN_INTERFACE=vcan0 RUST_BACKTRACE=1
outcome=passed
for test in ${tests[*]}; do
    echo "vcan0: \$test"
    /bin/\$test --test-threads=1 --nocapture || outcome=failed
done
echo "vcan0: \$outcome"
\$busybox poweroff -f
END
chmod +x "$root/init"
(cd "$root" && find . | cpio --create --format=newc --quiet | gzip -1) >"$folder/initramfs"

start=$SECONDS
# The exit code of the emulator does not reflect the guest's result.
timeout 600 qemu-system-x86_64 -machine q35 -cpu max -accel tcg -icount shift=0,sleep=off -m 512 \
    -display none -monitor none -serial "file:$console" -net none -no-reboot \
    -kernel "$folder/kernel/vmlinuz" -initrd "$folder/initramfs" \
    -append "console=ttyS0 panic=-1 quiet" </dev/null || true
tr -d '\r' <"$console" | sed -n '/^vcan0: /,$p' | tee "$folder/tests.log"
echo "$(cat "$folder/kernel/package"): $((SECONDS - start)) s in the virtual machine"
grep -qx 'vcan0: passed' "$folder/tests.log"
