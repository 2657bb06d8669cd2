#include "cortexm/hal_semihosting.h"

#include <stdint.h>
#include <string.h>

/* Operations, modes and the reason for the exit, as Arm numbers them. */
enum operation {
    SYS_OPEN = 0x01,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20
};
enum mode { MODE_READ_BINARY = 1, MODE_WRITE = 4 };
#define APPLICATION_EXIT 0x20026u

/* In hal_semihosting_call.S. block: the operation's arguments, one word each. */
int32_t hal_semihosting_call(uint32_t operation, void *block);

static uintptr_t address_of(const void *at)
{
    return (uintptr_t)at;
}

static int open_file(const char *name, enum mode mode)
{
    uintptr_t block[3] = {address_of(name), (uintptr_t)mode, strlen(name)};
    return (int)hal_semihosting_call(SYS_OPEN, block);
}

int hal_semihosting_open(const char *name)
{
    return open_file(name, MODE_READ_BINARY);
}

bool hal_semihosting_read(int file, void *data, size_t size)
{
    uintptr_t block[3] = {(uintptr_t)file, address_of(data), size};
    return hal_semihosting_call(SYS_READ, block) == 0; /* bytes that are missing */
}

bool hal_semihosting_write(const char *text, size_t size)
{
    static int output = -1;
    if (output < 0) {
        output = open_file(":tt", MODE_WRITE);
    }
    uintptr_t block[3] = {(uintptr_t)output, address_of(text), size};
    return output >= 0 && hal_semihosting_call(SYS_WRITE, block) == 0;
}

bool hal_semihosting_command_line(char *line, size_t size)
{
    uintptr_t block[2] = {address_of(line), size};
    return hal_semihosting_call(SYS_GET_CMDLINE, block) == 0;
}

_Noreturn void hal_semihosting_exit(int status)
{
    uintptr_t block[2] = {APPLICATION_EXIT, (uintptr_t)status};
    for (;;) {
        hal_semihosting_call(SYS_EXIT_EXTENDED, block);
    }
}
