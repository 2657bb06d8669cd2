#include "linux/hal_descriptors.h"

#include <dirent.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

/* The kernel lists what is open; a limit to count up to could be a thousand million. */
bool hal_descriptors_keep(const int *keep_fds, int keep_count)
{
    DIR *list = opendir("/proc/self/fd");
    if (list == NULL) {
        return false;
    }
    for (const struct dirent *entry = readdir(list); entry != NULL; entry = readdir(list)) {
        int fd = (int)strtol(entry->d_name, NULL, 10);
        bool keep = entry->d_name[0] == '.' || fd == dirfd(list);
        for (int i = 0; i < keep_count; i++) {
            keep = keep || fd == keep_fds[i];
        }
        if (!keep) {
            close(fd);
        }
    }
    closedir(list);
    return true;
}
