/* hal_guard_page - the memory that a program and its guards share: who is alive, and what is on.
 *
 * Each value has one writer. What cannot be read in one piece counts as on.
 */
#ifndef HAL_GUARD_PAGE_H
#define HAL_GUARD_PAGE_H

#include <stdatomic.h>

#include "linux/hal_guard.h"

/* No sign of life of a guard for so long: it does not guard. */
#define GUARD_STALE_MS 200
/* How the page is called, before the line's name, in /proc/PID/maps. */
#define GUARD_PAGE_NAME "isohead-laser:"

/* How the names of processes that map it begin, in /proc/PID/comm. */
#define GUARD_PROCESS_NAME "isohead"

struct hal_guard_page {
    /* By the program. */
    _Atomic unsigned writes; /* odd: being written */
    _Atomic bool is_on;      /* announced before it is switched on, until it is off */
    _Atomic int64_t edge_us; /* when that changed */
    _Atomic int64_t sum_us;  /* on before that */
    _Atomic int64_t judged_on_us;
    /* By each guard. */
    struct {
        _Atomic int64_t life_us;
        _Atomic unsigned cut_count; /* risen before it switches off */
        _Atomic bool refuses;
    } guard[HAL_GUARD_COUNT];
};

_Static_assert(ATOMIC_LLONG_LOCK_FREE == 2, "a lock would be held by who is stopped");

struct hal_guard_view {
    unsigned writes;
    bool is_on;
    int64_t on_us; /* in all, until now */
    int64_t judged_on_us;
};

/* A page that children share; this process is renamed to be found by it. NULL: errno. */
struct hal_guard_page *hal_guard_page_new(const char *line_name);
void hal_guard_page_free(struct hal_guard_page *page);

int64_t hal_guard_now_us(void);

/* By the program; safe in a signal handler. */
void hal_guard_page_announce(struct hal_guard_page *page, bool on);
void hal_guard_page_judged(struct hal_guard_page *page);

/* False: it is being written. */
bool hal_guard_page_read(const struct hal_guard_page *page, int64_t now_us,
                         struct hal_guard_view *view);

/* Has a guard shown life within GUARD_STALE_MS? */
bool hal_guard_page_lives(const struct hal_guard_page *page, int guard, int64_t now_us);

#endif
