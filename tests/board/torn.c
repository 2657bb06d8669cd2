/* torn - writes below some folders are noted and may fail: to be named in LD_PRELOAD.
 *
 *   TORN_BELOW    folders with a colon between them, each with its slash; what is elsewhere is left alone
 *   TORN_JOURNAL  a line is added for each operation: `create`, `truncate`, `write`, `rename`, `remove`, `folder` with
 *                 its paths, for a write with offset and bytes in hex; `sync`
 *   TORN_AT       the number, from 1, of the operation that fails; 0 or nothing: none
 *   TORN_HOW      EIO: this one fails; ENOSPC: of a write half is done, and from then on nothing that needs room works;
 *                 CUT: the process and all after it do nothing any more
 *
 * Operations are counted by the length of TORN_JOURNAL.count, over all processes of a script, which run one after the
 * other.
 */
#define _GNU_SOURCE
#undef _FILE_OFFSET_BITS /* open and open64 are two */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#define PATH_BYTES 4096

enum verdict { TORN_GOES, TORN_FAILS, TORN_HALF };

static void *real(const char *name)
{
    void *function = dlsym(RTLD_NEXT, name);
    if (function == NULL) {
        abort();
    }
    return function;
}

static int real_open(const char *path, int flags, mode_t mode)
{
    int (*function)(const char *, int, ...) = (int (*)(const char *, int, ...))real("open");
    return function(path, flags, mode);
}

static ssize_t real_write(int fd, const void *bytes, size_t count)
{
    ssize_t (*function)(int, const void *, size_t) =
        (ssize_t(*)(int, const void *, size_t))real("write");
    return function(fd, bytes, count);
}

static bool is_below(const char *path)
{
    const char *below = getenv("TORN_BELOW");
    while (below != NULL) {
        const size_t length = strcspn(below, ":");
        if (strncmp(path, below, length) == 0) {
            return true;
        }
        below = below[length] == 0 ? NULL : below + length + 1;
    }
    return false;
}

static void append(const char *suffix, const char *bytes, size_t count)
{
    char path[PATH_BYTES];
    snprintf(path, sizeof path, "%s%s", getenv("TORN_JOURNAL"), suffix);
    int fd = real_open(path, O_WRONLY | O_CREAT | O_APPEND, 0666);
    if (fd < 0 || real_write(fd, bytes, count) != (ssize_t)count) {
        abort();
    }
    close(fd);
}

static long next_number(void)
{
    char path[PATH_BYTES];
    struct stat status;
    append(".count", "x", 1);
    snprintf(path, sizeof path, "%s.count", getenv("TORN_JOURNAL"));
    return stat(path, &status) == 0 ? (long)status.st_size : 0;
}

/* What becomes of the next operation; errno is set for one that fails. */
static enum verdict judge(bool needs_room)
{
    const char *at = getenv("TORN_AT");
    const char *how = getenv("TORN_HOW");
    const long failing = at == NULL ? 0 : strtol(at, NULL, 10);
    const long number = next_number();
    if (failing == 0 || number < failing || how == NULL) {
        return TORN_GOES;
    }
    if (strcmp(how, "CUT") == 0) {
        raise(SIGKILL);
    }
    if (strcmp(how, "EIO") == 0) {
        errno = EIO;
        return number == failing ? TORN_FAILS : TORN_GOES;
    }
    errno = ENOSPC;
    if (!needs_room) {
        return TORN_GOES;
    }
    return number == failing ? TORN_HALF : TORN_FAILS;
}

static void note(const char *what, const char *path, const char *more)
{
    char line[3 * PATH_BYTES];
    int length = snprintf(line, sizeof line, "%s\t%s\t%s\n", what, path, more == NULL ? "" : more);
    append("", line, (size_t)length);
}

/* --- files --- */

static int open_noted(const char *path, int flags, mode_t mode)
{
    struct stat status;
    const bool is_there = stat(path, &status) == 0;
    const bool is_new = (flags & O_CREAT) != 0 && !is_there;
    const bool is_cut = (flags & O_TRUNC) != 0 && is_there && status.st_size > 0;
    if (is_below(path) && (is_new || is_cut)) {
        if (judge(is_new) != TORN_GOES) {
            return -1;
        }
        note(is_new ? "create" : "truncate", path, NULL);
    }
    return real_open(path, flags, mode);
}

static mode_t mode_of(int flags, va_list list)
{
    return (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
}

int open(const char *path, int flags, ...)
{
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return open_noted(path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return open_noted(path, flags, mode);
}

/* Scripts name whole paths: only those are of interest here. */
static int openat_noted(int at, const char *path, int flags, mode_t mode)
{
    int (*function)(int, const char *, int, ...) =
        (int (*)(int, const char *, int, ...))real("openat");
    return path[0] == '/' ? open_noted(path, flags, mode) : function(at, path, flags, mode);
}

int openat(int at, const char *path, int flags, ...)
{
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return openat_noted(at, path, flags, mode);
}

int openat64(int at, const char *path, int flags, ...)
{
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return openat_noted(at, path, flags, mode);
}

ssize_t write(int fd, const void *bytes, size_t count)
{
    char link[64], path[PATH_BYTES];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) {
        return real_write(fd, bytes, count);
    }
    path[length] = 0;
    if (!is_below(path)) {
        return real_write(fd, bytes, count);
    }
    const enum verdict verdict = judge(true);
    if (verdict == TORN_FAILS || (verdict == TORN_HALF && count < 2)) {
        return -1;
    }
    count = verdict == TORN_HALF ? count / 2 : count;
    const off_t offset = lseek(fd, 0, SEEK_CUR);
    char *line = malloc(PATH_BYTES + 32 + 2 * count);
    if (line == NULL) {
        abort();
    }
    int at = snprintf(line, PATH_BYTES + 32, "write\t%s\t%lld\t", path, (long long)offset);
    for (size_t i = 0; i < count; i++) {
        at += sprintf(line + at, "%02x", ((const uint8_t *)bytes)[i]);
    }
    line[at++] = '\n';
    append("", line, (size_t)at);
    free(line);
    return real_write(fd, bytes, count);
}

/* What would go past write: the callers then do it by read and write. */
ssize_t copy_file_range(int from, off_t *from_at, int to, off_t *to_at, size_t count,
                        unsigned flags)
{
    (void)from, (void)from_at, (void)to, (void)to_at, (void)count, (void)flags;
    errno = EXDEV;
    return -1;
}

/* --- names --- */

int renameat2(int from_at, const char *from, int to_at, const char *to, unsigned flags)
{
    int (*function)(int, const char *, int, const char *, unsigned) =
        (int (*)(int, const char *, int, const char *, unsigned))real("renameat2");
    if (is_below(from)) {
        if (judge(false) != TORN_GOES) {
            return -1;
        }
        note("rename", from, to);
    }
    return function(from_at, from, to_at, to, flags);
}

int rename(const char *from, const char *to)
{
    return renameat2(AT_FDCWD, from, AT_FDCWD, to, 0);
}

int renameat(int from_at, const char *from, int to_at, const char *to)
{
    return renameat2(from_at, from, to_at, to, 0);
}

int unlinkat(int at, const char *path, int flags)
{
    int (*function)(int, const char *, int) = (int (*)(int, const char *, int))real("unlinkat");
    if (is_below(path)) {
        if (judge(false) != TORN_GOES) {
            return -1;
        }
        note("remove", path, NULL);
    }
    return function(at, path, flags);
}

int unlink(const char *path)
{
    return unlinkat(AT_FDCWD, path, 0);
}

int mkdir(const char *path, mode_t mode)
{
    int (*function)(const char *, mode_t) = (int (*)(const char *, mode_t))real("mkdir");
    struct stat status;
    if (is_below(path) && stat(path, &status) != 0) {
        if (judge(true) != TORN_GOES) {
            return -1;
        }
        note("folder", path, NULL);
    }
    return function(path, mode);
}

/* --- what is on the disk from now on --- */

void sync(void)
{
    if (getenv("TORN_BELOW") != NULL && judge(false) == TORN_GOES) {
        append("", "sync\n", strlen("sync\n"));
    }
}
