/* golden - the golden set on a Cortex-M. The last word of the command line is the file. */
#include "cortexm/hal_semihosting.h"
#include "hal_text.h"
#include "golden.h"

static int file;

bool golden_read(void *data, size_t size)
{
    return hal_semihosting_read(file, data, size);
}

bool golden_write(const char *text, size_t size)
{
    return hal_semihosting_write(text, size);
}

static int fail(const char *text)
{
    golden_write(text, hal_text_length(text));
    return 2;
}

int main(void)
{
    char line[200] = {0};
    if (!hal_semihosting_command_line(line, sizeof line)) {
        return fail("golden: no command line, or one of 200 bytes and more\n");
    }
    const char *name = line;
    for (const char *at = line; *at != 0; at++) {
        name = *at == ' ' ? at + 1 : name;
    }
    file = hal_semihosting_open(name);
    if (file < 0) {
        return fail("golden: the file that the command line ends with cannot be opened\n");
    }
    return golden_run() ? 0 : 1;
}
