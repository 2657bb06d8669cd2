/* A terminal of the test's own; without one, as in a container without /dev/pts, the test is left out. */
#ifndef APP_TERMINAL_H
#define APP_TERMINAL_H

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "unity.h"

/* The master's side; its name for others is ptsname's. */
static inline int terminal_open(void)
{
    int master = posix_openpt(O_RDWR | O_NOCTTY);

    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        access(ptsname(master), R_OK | W_OK) != 0) {
        if (master >= 0) {
            close(master);
        }
        TEST_IGNORE_MESSAGE("no terminal can be opened here: is /dev/pts mounted?");
    }
    return master;
}

#endif
