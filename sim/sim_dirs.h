/* sim_dirs - which frames directories the command line means.
 *
 * A DIR with a rig.json is one itself; any other stands for those of its subdirectories that have
 * one or cannot be looked into, in byte order of their names, hidden ones and a disk's lost+found left
 * out. With --rig frames do in place of a rig.json. A DIR that is neither, or cannot be read to its end,
 * is an error in the report.
 */
#ifndef SIM_DIRS_H
#define SIM_DIRS_H

#include <stdbool.h>
#include <stddef.h>

#include "sim_report.h"

struct sim_dir {
    char *path;
    char *label;       /* last part of the path, unique among all: names rows and trace folders */
    size_t file_count; /* what may be frames in it, for the progress */
};

struct sim_dirs {
    struct sim_dir *dir;
    size_t dir_count, dir_capacity;
    size_t file_count; /* of all */
};

/* with_rig: a rig comes from elsewhere. Adds to dirs. */
void sim_dirs_add(struct sim_dirs *dirs, const char *path, bool with_rig,
                  struct sim_report *report);
/* Is there a file at the path that a run reads, under whatever name: a frame, a list, a rig of these directories? */
bool sim_dirs_has_input(const struct sim_dirs *dirs, const char *path);

/* Is the directory at the path one of these, under whatever name? */
bool sim_dirs_has(const struct sim_dirs *dirs, const char *path);

void sim_dirs_free(struct sim_dirs *dirs);

#endif
