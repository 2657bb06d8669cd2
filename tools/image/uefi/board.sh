# What an image for boards with UEFI firmware has of its own; read in by image.sh and slot.sh.
# shellcheck shell=sh disable=SC2034,SC2154 # they use what is set here, and set what is used here

board_packages() { echo "$("$apt" newest 'linux-image-6\.1\.0-[0-9]*-arm64'):arm64 systemd-boot-efi:arm64"; }
BOOT_KIND=boot

# board_linked: package URLs of what the program is linked with that no package brings
board_linked() { :; }

# board_boot: the boot loader's files, and the kernel as it takes it, into $work/boot
board_boot() {
    cp "$kernel" "$work/boot/linux"
    cp "$packages/usr/lib/systemd/boot/efi/systemd-bootaa64.efi" "$work/boot/"
}

# entry SLOT VERSION: its boot loader entry; 3 tries
entry() {
    cat <<ENTRY
title isohead, slot $1
sort-key isohead
version $2
linux /$1/linux
initrd /$1/initrd
options isohead.slot=$1 isohead.bytes=$bytes isohead.sha256=$sha256 panic=5 loglevel=4
ENTRY
}

# board_esp ESP: what it has beside the slots' kernels
board_esp() {
    mmd -i "$1" ::/EFI ::/EFI/BOOT ::/loader ::/loader/entries
    mcopy -i "$1" "$out/boot/systemd-bootaa64.efi" ::/EFI/BOOT/BOOTAA64.EFI
    # Nobody edits a command line in the menu: it says what is checked of the slot.
    printf 'timeout 0\neditor no\nauto-entries no\nauto-firmware no\n' | mcopy -i "$1" - ::/loader/loader.conf
    entry a 2 | mcopy -i "$1" - ::/loader/entries/slot-a+3.conf
    entry b 1 | mcopy -i "$1" - ::/loader/entries/slot-b+3.conf
}

# board_table: the partition table, for sfdisk
board_table() {
    cat <<TABLE
label: gpt
label-id: $(identifier disk)
first-lba: 2048
start=2048, size=${ESP_MIB}MiB, type=uefi, name=isohead-esp, uuid=$(identifier esp)
size=${SLOT_MIB}MiB, type=linux, name=isohead-a, uuid=$(identifier a)
size=${SLOT_MIB}MiB, type=linux, name=isohead-b, uuid=$(identifier b)
size=${DATA_MIB}MiB, type=EBD0A0A2-B9E5-4433-87C0-68B6B72699C7, name=isohead-data, uuid=$(identifier data)
TABLE
}

# board_state IMAGE: what lies outside of the partitions
board_state() { :; }
