#include "fuzz_file.h"

#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define PATH_MAX_BYTES 256

static struct {
    char path[PATH_MAX_BYTES];
    const char *name[FUZZ_FILES_MAX];
    int name_count;
} directory;

static void join(char path[PATH_MAX_BYTES], const char *name)
{
    int length = snprintf(path, PATH_MAX_BYTES, "%s/%s", directory.path, name);
    FUZZ_CHECK(length > 0 && length < PATH_MAX_BYTES);
}

const char *fuzz_file_path(const uint8_t *bytes, size_t size)
{
    static char path[PATH_MAX_BYTES];
    static int file = -1;
    if (file < 0) {
        file = memfd_create("fuzz", 0);
        FUZZ_CHECK(file >= 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    FUZZ_CHECK(ftruncate(file, 0) == 0);
    FUZZ_CHECK(pwrite(file, bytes, size, 0) == (ssize_t)size);
    return path;
}

static void remove_directory(void)
{
    for (int i = 0; i < directory.name_count; i++) {
        char path[PATH_MAX_BYTES];
        join(path, directory.name[i]);
        unlink(path);
    }
    rmdir(directory.path);
}

const char *fuzz_file_directory(void)
{
    if (directory.path[0] == 0) {
        const char *temporary = getenv("TMPDIR");
        snprintf(directory.path, sizeof directory.path, "%s/fuzz_XXXXXX",
                 temporary != NULL ? temporary : "/tmp");
        FUZZ_CHECK(mkdtemp(directory.path) != NULL);
        FUZZ_CHECK(atexit(remove_directory) == 0);
    }
    return directory.path;
}

static void remember(const char *name)
{
    for (int i = 0; i < directory.name_count; i++) {
        if (strcmp(directory.name[i], name) == 0) {
            return;
        }
    }
    FUZZ_CHECK(directory.name_count < FUZZ_FILES_MAX);
    directory.name[directory.name_count++] = name;
}

void fuzz_file_write(const char *name, const uint8_t *bytes, size_t size)
{
    char path[PATH_MAX_BYTES];
    fuzz_file_directory();
    remember(name);
    join(path, name);
    FILE *file = fopen(path, "wb");
    FUZZ_CHECK(file != NULL);
    FUZZ_CHECK(fwrite(bytes, 1, size, file) == size);
    FUZZ_CHECK(fclose(file) == 0);
}
