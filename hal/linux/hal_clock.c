#include "linux/hal_clock.h"

#include <time.h>

static int64_t now_us(void *context)
{
    struct timespec now;
    (void)context;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

const struct hal_clock hal_clock = {.now_us = now_us};
