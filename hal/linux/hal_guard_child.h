/* hal_guard_child - what a guard does on its side of the fork; see hal_guard.h. */
#ifndef HAL_GUARD_CHILD_H
#define HAL_GUARD_CHILD_H

#include "linux/hal_guard_page.h"

/* The bytes on the socket. */
#define GUARD_ALIVE 'a' /* to the guard */
#define GUARD_ON 'n'    /* to the guard, before it is switched on: signs of life will follow */
#define GUARD_OFF 'o'   /* to the guard, after it was switched off: they need not */
#define GUARD_DONE 'd'  /* to the guard: off, and end */
#define GUARD_READY 'r' /* from the guard, once */

/* The guard's exit status. */
enum guard_exit {
    GUARD_EXIT_DONE = 0,  /* the other process said so */
    GUARD_EXIT_GONE = 1,  /* the other process has died */
    GUARD_EXIT_LATE = 2,  /* no sign of life of the other process for too long */
    GUARD_EXIT_SETUP = 3, /* it never began */
    GUARD_EXIT_LINE = 4   /* the line could not be set */
};

#define GUARD_OFF_TRIES 100
/* Between two looks at the page and the line. */
#define GUARD_LOOK_MS 20
/* Between two looks whether the interlock's event has been taken. */
#define GUARD_EVENT_MS 2

/* The child's life, right after the fork with all signals blocked. index: which of the guards it is.
 * Does not return. */
_Noreturn void hal_guard_child(const struct hal_guard_config *config, struct hal_guard_page *page,
                               int index, int socket_fd);

#endif
