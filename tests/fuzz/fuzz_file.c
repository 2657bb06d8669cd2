#include "fuzz.h"

#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define PATH_MAX_BYTES 256

struct file {
    const char *name;
    int descriptor;
    char path[PATH_MAX_BYTES]; /* of the file itself */
};

static struct {
    char path[PATH_MAX_BYTES];
    struct file file[FUZZ_FILES_MAX];
    int file_count;
} directory;

static void make(struct file *file, const char *name)
{
    file->name = name;
    file->descriptor = memfd_create(name, 0);
    FUZZ_CHECK(file->descriptor >= 0);
    snprintf(file->path, sizeof file->path, "/proc/self/fd/%d", file->descriptor);
}

static void rewrite(const struct file *file, const uint8_t *bytes, size_t size)
{
    FUZZ_CHECK(ftruncate(file->descriptor, 0) == 0);
    FUZZ_CHECK(pwrite(file->descriptor, bytes, size, 0) == (ssize_t)size);
}

const char *fuzz_file_path(const uint8_t *bytes, size_t size)
{
    static struct file file;
    if (file.name == NULL) {
        make(&file, "file");
    }
    rewrite(&file, bytes, size);
    return file.path;
}

static void join(char path[PATH_MAX_BYTES], const char *name)
{
    int length = snprintf(path, PATH_MAX_BYTES, "%s/%s", directory.path, name);
    FUZZ_CHECK(length > 0 && length < PATH_MAX_BYTES);
}

static void remove_directory(void)
{
    for (int i = 0; i < directory.file_count; i++) {
        char path[PATH_MAX_BYTES];
        join(path, directory.file[i].name);
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

static const struct file *find_or_make(const char *name)
{
    for (int i = 0; i < directory.file_count; i++) {
        if (strcmp(directory.file[i].name, name) == 0) {
            return &directory.file[i];
        }
    }
    FUZZ_CHECK(directory.file_count < FUZZ_FILES_MAX);
    fuzz_file_directory();
    struct file *file = &directory.file[directory.file_count++];
    char path[PATH_MAX_BYTES];
    make(file, name);
    join(path, name);
    FUZZ_CHECK(symlink(file->path, path) == 0);
    return file;
}

void fuzz_file_write(const char *name, const uint8_t *bytes, size_t size)
{
    rewrite(find_or_make(name), bytes, size);
}
