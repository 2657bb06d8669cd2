/* hal_semihosting - files, output and exit status of the machine that a Cortex-M hangs on: a debugger,
 * or QEMU with -semihosting-config enable=on (Arm's "Semihosting for AArch32 and AArch64").
 *
 * Without either the first call locks the processor up.
 */
#ifndef HAL_SEMIHOSTING_H
#define HAL_SEMIHOSTING_H

#include <stdbool.h>
#include <stddef.h>

#include "hal.h"

/* A file for reading; negative when it cannot be opened. name ends with a zero byte. */
int hal_semihosting_open(const char *name);

/* True: size bytes were read. */
bool hal_semihosting_read(int file, void *data, size_t size);

/* A file whole, into size bytes of memory; *length of them are its own. False: *error says why. */
bool hal_semihosting_load(const char *name, void *data, size_t size, size_t *length,
                          struct hal_error *error);

/* To standard output, or to standard error. True: all of it was written. */
bool hal_semihosting_write(const char *text, size_t size);
bool hal_semihosting_complain(const char *text, size_t size);

/* The command line, its words apart by blanks, ending with a zero byte; false when it does not fit. */
bool hal_semihosting_command_line(char *line, size_t size);

/* End the program with a status, 0 for success. */
_Noreturn void hal_semihosting_exit(int status);

#endif
