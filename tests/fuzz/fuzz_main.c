/* The main of a fuzz target without libFuzzer.
 *
 *   fuzz_NAME FILE|DIRECTORY...    replay each file, and each file of a directory
 *
 * Built by afl-clang-fast it is AFL++'s, in persistent mode. */
#include <dirent.h>
#include <errno.h>
#include <string.h>
#include <sys/stat.h>

#include "fuzz.h"

/* In memory of exactly its size, so that the address sanitizer sees a read beyond it. */
static void run(const uint8_t *bytes, size_t size)
{
    uint8_t *copy = malloc(size > 0 ? size : 1);
    FUZZ_CHECK(copy != NULL);
    memcpy(copy, bytes, size);
    LLVMFuzzerTestOneInput(copy, size);
    free(copy);
}

#ifdef __AFL_FUZZ_TESTCASE_LEN

#include <unistd.h>

/* Executions before the process is started anew. */
#define LOOP 10000

__AFL_FUZZ_INIT()

int main(void)
{
    __AFL_INIT();
    const uint8_t *bytes = __AFL_FUZZ_TESTCASE_BUF;
    while (__AFL_LOOP(LOOP)) {
        run(bytes, (size_t)__AFL_FUZZ_TESTCASE_LEN);
    }
    return 0;
}

#else

/* Inputs are small: what is larger is none. */
#define FILE_MAX ((size_t)1 << 20)
#define PATH_MAX_BYTES 4096

static int fail(const char *path, const char *text)
{
    fprintf(stderr, "%s: %s\n", path, text);
    exit(2);
}

static void replay_file(const char *path)
{
    static uint8_t bytes[FILE_MAX + 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        fail(path, strerror(errno));
    }
    size_t size = fread(bytes, 1, sizeof bytes, file);
    if (ferror(file) || size > FILE_MAX) {
        fail(path, "cannot be read, or is longer than 1 MiB");
    }
    fclose(file);
    run(bytes, size);
}

static long replay_directory(const char *path)
{
    struct dirent **entries = NULL;
    long replayed = 0;
    int count = scandir(path, &entries, NULL, alphasort);
    if (count < 0) {
        fail(path, strerror(errno));
    }
    for (int i = 0; i < count; i++) {
        char file[PATH_MAX_BYTES];
        snprintf(file, sizeof file, "%s/%s", path, entries[i]->d_name);
        if (entries[i]->d_name[0] != '.') {
            replay_file(file);
            replayed++;
        }
        free(entries[i]);
    }
    free(entries);
    return replayed;
}

int main(int count, char **arguments)
{
    long replayed = 0;
    for (int i = 1; i < count; i++) {
        struct stat status;
        if (stat(arguments[i], &status) != 0) {
            fail(arguments[i], strerror(errno));
        }
        if (S_ISDIR(status.st_mode)) {
            replayed += replay_directory(arguments[i]);
        } else {
            replay_file(arguments[i]);
            replayed++;
        }
    }
    if (replayed == 0) {
        return fail(arguments[0], "no input, expected files or directories with some");
    }
    printf("%ld inputs\n", replayed);
    return 0;
}

#endif
