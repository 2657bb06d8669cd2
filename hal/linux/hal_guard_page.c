#include "linux/hal_guard_page.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

struct hal_guard_page *hal_guard_page_new(const char *line_name)
{
    char name[sizeof GUARD_PAGE_NAME + 64];
    snprintf(name, sizeof name, GUARD_PAGE_NAME "%.64s", line_name);
    int fd = memfd_create(name, MFD_CLOEXEC);
    if (fd < 0) {
        return NULL;
    }
    void *page = MAP_FAILED;
    if (ftruncate(fd, sizeof(struct hal_guard_page)) == 0) {
        page = mmap(NULL, sizeof(struct hal_guard_page), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    }
    close(fd);
    prctl(PR_SET_NAME, GUARD_PROCESS_NAME "_board");
    return page == MAP_FAILED ? NULL : page;
}

void hal_guard_page_free(struct hal_guard_page *page)
{
    if (page != NULL) {
        munmap(page, sizeof *page);
    }
}

int64_t hal_guard_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

void hal_guard_page_announce(struct hal_guard_page *page, bool on)
{
    int64_t now_us = hal_guard_now_us();
    if (page->is_on == on) {
        return;
    }
    page->writes++;
    if (!on) {
        page->sum_us += now_us - page->edge_us;
    }
    page->is_on = on;
    page->edge_us = now_us;
    page->writes++;
}

void hal_guard_page_judged(struct hal_guard_page *page)
{
    page->judged_on_us =
        page->sum_us + (page->is_on ? hal_guard_now_us() - page->edge_us : INT64_C(0));
}

bool hal_guard_page_read(const struct hal_guard_page *page, int64_t now_us,
                         struct hal_guard_view *view)
{
    view->writes = page->writes;
    view->is_on = page->is_on;
    view->judged_on_us = page->judged_on_us;
    int64_t edge_us = page->edge_us, sum_us = page->sum_us;
    /* Switched on after the caller has looked at the clock: not yet. */
    view->on_us = sum_us + (view->is_on && now_us > edge_us ? now_us - edge_us : 0);
    return view->writes % 2 == 0 && view->writes == page->writes;
}

bool hal_guard_page_lives(const struct hal_guard_page *page, int guard, int64_t now_us)
{
    int64_t age_us = now_us - page->guard[guard].life_us;
    return age_us < GUARD_STALE_MS * 1000 && age_us > -GUARD_STALE_MS * 1000;
}

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

/* Without its maps, which wait for as long as the process waits in the kernel for memory. */
static bool has_our_name(pid_t pid)
{
    char path[32], name[32] = "";
    snprintf(path, sizeof path, "/proc/%d/comm", (int)pid);
    FILE *comm = fopen(path, "re");
    if (comm == NULL) {
        return false;
    }
    bool good = fgets(name, sizeof name, comm) != NULL &&
                strncmp(name, GUARD_PROCESS_NAME, strlen(GUARD_PROCESS_NAME)) == 0;
    fclose(comm);
    return good;
}

/* 1: ended; 0: none of ours; -1: *error. Its number may be given to another process at any time: the
 * descriptor is of the one that was looked into. */
static int end_one(pid_t pid, const char *line_name, struct hal_error *error)
{
    if (!has_our_name(pid) || !maps_page(pid, line_name)) {
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
