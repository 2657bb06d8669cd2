# What an image for the Raspberry Pi has of its own; read in by image.sh and slot.sh.
#
# Its packages are of Debian 13: the firmware in 12 is too old for a Raspberry Pi 5, and so are all its
# kernels; 6.12 has no driver for its SD card, nor for USB and GPIO. Backports' kernel has.
# shellcheck shell=sh disable=SC2034,SC2154 # they use what is set here, and set what is used here

export SUITE=trixie
board_packages() {
    kernel_package=$("$apt" newest 'linux-image-[0-9.]*\+deb13-arm64')
    release=${kernel_package#linux-image-}
    # The kernel has been in one package and in several.
    for package in "linux-image-$release" "linux-base-$release" "linux-binary-$release" "linux-modules-$release"; do
        "$apt" newest "$(echo "$package" | sed 's/[.+]/\\&/g')" 2>/dev/null | sed 's/$/:arm64/'
    done
    echo raspi-firmware u-boot-rpi:arm64
}
BOOT_KIND=rpi

board_linked() { sed 's|\(.*\)-|pkg:pypi/\1@|' build/third_party/gpiod2/package; }

board_boot() {
    # U-Boot unpacks it; reading takes longer.
    gzip -9 -n <"$kernel" >"$work/boot/linux"
    for name in bootcode.bin start.elf fixup.dat start4.elf fixup4.dat; do
        cp "$packages/usr/lib/raspi-firmware/$name" "$work/boot/"
    done
    cp "$packages/usr/share/doc/raspi-firmware/copyright" "$work/boot/LICENCE.raspi-firmware"
    cp "$packages/usr/lib/u-boot/rpi_arm64/u-boot.bin" "$work/boot/"
    find "$packages" -path '*/broadcom/bcm*-rpi-*.dtb' -exec cp {} "$work/boot/" \;
    mkenvimage -s 0x4000 -p 0x00 -o "$work/boot/uboot.env" "$here/rpi/uboot.env"
    # os_check: U-Boot does not say which boards it is for, and a Raspberry Pi 5 would ask.
    cat >"$work/boot/config.txt" <<CONFIG
# What the Raspberry Pi's own firmware reads. It starts U-Boot, which starts a slot.
arm_64bit=1
kernel=u-boot.bin
upstream_kernel=1
enable_uart=1
[pi5]
os_check=0
[all]
CONFIG
}

board_esp() {
    find "$out/boot" -type f ! -name linux ! -name initrd | sort | while read -r file; do
        mcopy -i "$1" "$file" ::/
    done
}

board_table() {
    cat <<TABLE
label: dos
label-id: 0x15048ead
start=2048, size=${ESP_MIB}MiB, type=c, bootable
size=${SLOT_MIB}MiB, type=83
size=${SLOT_MIB}MiB, type=83
size=${DATA_MIB}MiB, type=c
TABLE
}

board_state() {
    printf 'first=a\n' >"$out/state.txt"
    for name in a b; do
        printf '%s_left=3\n%s_bytes=%s\n%s_sha256=%s\n' $name $name "$bytes" $name "$sha256"
    done >>"$out/state.txt"
    mkenvimage -s 0x200 -p 0x00 -o "$out/state" "$out/state.txt"
    for sector in 1 9; do
        dd if="$out/state" of="$1" bs=512 seek=$sector conv=notrunc status=none
    done
}
