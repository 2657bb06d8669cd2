#include "cortexm/hal_semihosting.h"

#include <stdint.h>

#include "hal_text.h"

/* Operations, modes and the reason for the exit, as Arm numbers them. */
enum operation {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_FLEN = 0x0c,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20
};
/* Of the console ":tt" MODE_WRITE is standard output, MODE_APPEND standard error. */
enum mode { MODE_READ_BINARY = 1, MODE_WRITE = 4, MODE_APPEND = 8 };
#define CONSOLE ":tt"
#define APPLICATION_EXIT 0x20026u

/* In hal_semihosting_call.S. block: the operation's arguments, one word each. */
int32_t hal_semihosting_call(uint32_t operation, void *block);

static uintptr_t address_of(const void *at)
{
    return (uintptr_t)at;
}

static int open_file(const char *name, enum mode mode)
{
    uintptr_t block[3] = {address_of(name), (uintptr_t)mode, hal_text_length(name)};
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

static bool load(int file, void *data, size_t size, size_t *length, struct hal_error *error)
{
    uintptr_t block[1] = {(uintptr_t)file};
    int32_t count = hal_semihosting_call(SYS_FLEN, block);
    struct hal_text text = hal_text_begin(error->text, sizeof error->text);
    if (count < 0) {
        hal_text_put(&text, "its length is unknown");
    } else if ((size_t)count > size) {
        hal_text_put_number(&text, count, 1);
        hal_text_put(&text, " bytes, expected at most ");
        hal_text_put_number(&text, (int64_t)size, 1);
    } else if (!hal_semihosting_read(file, data, (size_t)count)) {
        hal_text_put(&text, "cannot be read");
    } else {
        *length = (size_t)count;
        return true;
    }
    return false;
}

bool hal_semihosting_load(const char *name, void *data, size_t size, size_t *length,
                          struct hal_error *error)
{
    int file = hal_semihosting_open(name);
    if (file < 0) {
        struct hal_text text = hal_text_begin(error->text, sizeof error->text);
        hal_text_put(&text, "cannot be opened");
        return false;
    }
    bool good = load(file, data, size, length, error);
    uintptr_t block[1] = {(uintptr_t)file};
    hal_semihosting_call(SYS_CLOSE, block);
    return good;
}

static bool put(int *file, enum mode mode, const char *text, size_t size)
{
    if (*file < 0) {
        *file = open_file(CONSOLE, mode);
    }
    uintptr_t block[3] = {(uintptr_t)*file, address_of(text), size};
    return *file >= 0 && hal_semihosting_call(SYS_WRITE, block) == 0;
}

bool hal_semihosting_write(const char *text, size_t size)
{
    static int output = -1;
    return put(&output, MODE_WRITE, text, size);
}

bool hal_semihosting_complain(const char *text, size_t size)
{
    static int output = -1;
    return put(&output, MODE_APPEND, text, size);
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
