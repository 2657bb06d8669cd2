#include "linux/hal_guard_end.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "linux/hal_guard_page.h"

static bool maps_page(pid_t pid, const char *line_name)
{
    char path[32], page[sizeof "/memfd:" GUARD_PAGE_NAME " (deleted)\n" + 64], line[512];
    bool found = false;
    snprintf(path, sizeof path, "/proc/%d/maps", (int)pid);
    snprintf(page, sizeof page, "/memfd:" GUARD_PAGE_NAME "%.64s (deleted)\n", line_name);
    FILE *maps = fopen(path, "re");
    if (maps == NULL) {
        return false;
    }
    while (!found && fgets(line, sizeof line, maps) != NULL) {
        const char *at = strchr(line, '/');
        found = at != NULL && strcmp(at, page) == 0;
    }
    fclose(maps);
    return found;
}

/* 1: ended; 0: none of ours; -1: *error. Its number may be given to another process at any time: the
 * descriptor is of the one that was looked into. */
static int end_one(pid_t pid, const char *line_name, struct hal_error *error)
{
    if (!maps_page(pid, line_name)) {
        return 0;
    }
    int fd = (int)syscall(SYS_pidfd_open, pid, 0);
    if (fd < 0) {
        if (errno == ESRCH) {
            return 0;
        }
        hal_fail(error, "process %d holds the line and cannot be ended: %s", (int)pid,
                 strerror(errno));
        return -1;
    }
    int ended = 0;
    if (maps_page(pid, line_name)) {
        ended = syscall(SYS_pidfd_send_signal, fd, SIGKILL, NULL, 0) == 0;
    }
    close(fd);
    return ended;
}

int hal_guard_end(const char *line_name, struct hal_error *error)
{
    int ended_count = 0;
    DIR *list = opendir("/proc");
    if (list == NULL) {
        hal_fail(error, "/proc: %s, so that nobody who holds the line is found", strerror(errno));
        return -1;
    }
    for (const struct dirent *entry = readdir(list); entry != NULL; entry = readdir(list)) {
        pid_t pid = (pid_t)strtol(entry->d_name, NULL, 10);
        int ended = pid > 0 && pid != getpid() ? end_one(pid, line_name, error) : 0;
        if (ended < 0) {
            ended_count = -1;
            break;
        }
        ended_count += ended;
    }
    closedir(list);
    return ended_count;
}
