/* golden FILE - the golden set on a machine with an operating system; hashes on standard output. */
#include <stdio.h>

#include "golden.h"

static FILE *file;

bool golden_read(void *data, size_t size)
{
    return fread(data, 1, size, file) == size;
}

bool golden_write(const char *text, size_t size)
{
    return fwrite(text, 1, size, stdout) == size;
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        fputs("usage: golden FILE\n", stderr);
        return 2;
    }
    file = fopen(arguments[1], "rb");
    if (file == NULL) {
        perror(arguments[1]);
        return 1;
    }
    bool good = golden_run();
    fclose(file);
    return good && fflush(stdout) == 0 ? 0 : 1;
}
