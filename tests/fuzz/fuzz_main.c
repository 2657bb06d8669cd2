/* The main of a fuzz target without libFuzzer.
 *
 *   fuzz_NAME FILE|PACK...    replay each file, and each input of a pack (NAME.pack, see corpus.py)
 *
 * Built by afl-clang-fast it is AFL++'s, in persistent mode. */
#include <errno.h>
#include <string.h>

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
#define PACK_HEADER "isohead fuzz inputs "

static int fail(const char *path, const char *text)
{
    fprintf(stderr, "%s: %s\n", path, text);
    exit(2);
}

static FILE *open_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        fail(path, strerror(errno));
    }
    return file;
}

static void replay_file(const char *path)
{
    static uint8_t bytes[FILE_MAX + 1];
    FILE *file = open_file(path);
    size_t size = fread(bytes, 1, sizeof bytes, file);
    if (ferror(file) || size > FILE_MAX) {
        fail(path, "cannot be read, or is longer than 1 MiB");
    }
    fclose(file);
    run(bytes, size);
}

/* -1 for any other character. */
static int hex_digit(char digit)
{
    static const char digits[] = "0123456789abcdef";
    const char *found = memchr(digits, digit, 16);
    return found != NULL ? (int)(found - digits) : -1;
}

/* False when the line is no input. */
static bool replay_line(const char *line, size_t length)
{
    static uint8_t bytes[FILE_MAX];
    if (length % 2 != 0 || length / 2 > FILE_MAX) {
        return false;
    }
    for (size_t i = 0; i < length; i += 2) {
        int high = hex_digit(line[i]);
        int low = hex_digit(line[i + 1]);
        if (high < 0 || low < 0) {
            return false;
        }
        bytes[i / 2] = (uint8_t)(16 * high + low);
    }
    run(bytes, length / 2);
    return true;
}

static long replay_pack(const char *path)
{
    FILE *file = open_file(path);
    char *line = NULL;
    size_t space = 0;
    long expected = 0;
    char end = 0;
    if (getline(&line, &space, file) < 0 ||
        sscanf(line, PACK_HEADER "%ld%c", &expected, &end) != 2 || end != '\n') {
        fail(path, "line 1 is not '" PACK_HEADER "COUNT'");
    }
    long replayed = 0;
    for (ssize_t length = getline(&line, &space, file); length > 0;
         length = getline(&line, &space, file)) {
        if (line[length - 1] != '\n') {
            fail(path, "the last line has no end");
        }
        if (!replay_line(line, (size_t)length - 1)) {
            fprintf(stderr, "%s: line %ld is not an input in hex digits\n", path, replayed + 2);
            exit(2);
        }
        replayed++;
    }
    if (ferror(file) || replayed != expected) {
        fprintf(stderr, "%s: %ld inputs, but line 1 says %ld\n", path, replayed, expected);
        exit(2);
    }
    free(line);
    fclose(file);
    return replayed;
}

static bool is_pack(const char *path)
{
    size_t length = strlen(path);
    return length > 5 && strcmp(&path[length - 5], ".pack") == 0;
}

int main(int count, char **arguments)
{
    long replayed = 0;
    for (int i = 1; i < count; i++) {
        if (is_pack(arguments[i])) {
            replayed += replay_pack(arguments[i]);
        } else {
            replay_file(arguments[i]);
            replayed++;
        }
    }
    if (replayed == 0) {
        return fail(arguments[0], "no input, expected files or packs with some");
    }
    printf("%ld inputs\n", replayed);
    return 0;
}

#endif
