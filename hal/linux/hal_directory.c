#include "linux/hal_directory.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "linux/hal_clock.h"

#define US_PER_S INT64_C(1000000)
#define HOLD_COUNT (HAL_CAMERA_HOLD_MAX + 1)
/* So far are sums of times from an overflow. */
#define TIME_MAX_US (INT64_MAX / 4)

static int64_t now_us(void)
{
    return hal_clock.now_us(hal_clock.context);
}

/* Until the frame of this index is due, from the one before it on. */
static int64_t step_us(const struct hal_directory *directory, size_t index)
{
    const struct hal_replay *replay = &directory->replay;
    if (directory->config.rate_mhz > 0) {
        return US_PER_S * 1000 / directory->config.rate_mhz;
    }
    if (index == 0 || index >= replay->entry_count) {
        return HAL_REPLAY_STEP_US;
    }
    int64_t step = replay->entry[index].time_us - replay->entry[index - 1].time_us;
    step = step < 0 ? 0 : step;
    return step > HAL_DIRECTORY_STEP_MAX_US ? HAL_DIRECTORY_STEP_MAX_US : step;
}

/* A time that has passed makes the descriptor readable at once; 0 would stop the timer. */
static bool set_timer(const struct hal_directory *directory)
{
    int64_t at_us = directory->due_us > 0 ? directory->due_us : 1;
    const struct itimerspec at = {.it_value = {.tv_sec = (time_t)(at_us / US_PER_S),
                                               .tv_nsec = (long)(at_us % US_PER_S * 1000)}};
    return timerfd_settime(directory->fd, TFD_TIMER_ABSTIME, &at, NULL) == 0;
}

static void close_directory(void *context)
{
    struct hal_directory *directory = context;
    if (directory->fd >= 0) {
        close(directory->fd);
    }
    directory->fd = -1;
    memset(directory->hold, 0, sizeof directory->hold);
}

static bool open_directory(void *context, struct hal_error *error)
{
    struct hal_directory *directory = context;
    close_directory(directory);
    directory->fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
    directory->due_us = now_us();
    if (directory->fd >= 0 && set_timer(directory)) {
        return true;
    }
    hal_fail(error, "no timer: %s", strerror(errno));
    close_directory(directory);
    return false;
}

static void name_frame(char name[HAL_DIRECTORY_NAME_MAX], int64_t sequence, struct hal_frame *frame)
{
    snprintf(name, HAL_DIRECTORY_NAME_MAX, "%06lld.pgm", (long long)sequence);
    frame->sequence = sequence;
    frame->name = name;
}

static struct hal_directory_hold *find_hold(struct hal_directory *directory)
{
    for (size_t i = 0; i < HOLD_COUNT; i++) {
        if (!directory->hold[i].used) {
            return &directory->hold[i];
        }
    }
    return NULL;
}

static void begin_again(struct hal_directory *directory)
{
    directory->passed_us = directory->last_us + HAL_REPLAY_STEP_US - directory->first_us;
    if (directory->passed_us > TIME_MAX_US) {
        directory->passed_us = 0;
    }
    directory->replay.next_index = 0;
}

/* From the directory, as a camera's. */
static enum hal_next take_frame(struct hal_directory *directory, struct hal_directory_hold *hold,
                                struct hal_frame *frame, struct hal_error *error)
{
    const struct hal_camera *camera = &directory->replay.camera;
    struct hal_error reason;
    enum hal_next next = camera->next(camera->context, frame, &reason);
    if (next == HAL_NEXT_END) {
        return next;
    }
    if (next == HAL_NEXT_FRAME) {
        directory->first_us = directory->has_first ? directory->first_us : frame->time_us;
        directory->has_first = true;
        directory->last_us = frame->time_us + directory->passed_us;
    }
    frame->time_us += directory->passed_us;
    if (next == HAL_NEXT_BAD) {
        hal_fail(error, "%s: %s", frame->name, reason.text);
        name_frame(directory->bad_name, directory->sequence, frame);
    } else {
        hold->used = true;
        name_frame(hold->name, directory->sequence, frame);
        frame->buffer_index = (int32_t)(hold - directory->hold);
    }
    directory->sequence++;
    return next;
}

static enum hal_next next_frame(void *context, struct hal_frame *frame, struct hal_error *error)
{
    struct hal_directory *directory = context;
    struct hal_replay *replay = &directory->replay;
    struct hal_directory_hold *hold = find_hold(directory);
    if (directory->fd < 0) {
        hal_fail(error, "the directory is not open");
        return HAL_NEXT_GONE;
    }
    if (hold == NULL || now_us() < directory->due_us) {
        return HAL_NEXT_NONE;
    }
    if (replay->next_index == replay->entry_count && directory->config.repeats) {
        begin_again(directory);
    }
    enum hal_next next = take_frame(directory, hold, frame, error);
    if (next == HAL_NEXT_END) {
        return next;
    }
    directory->due_us += step_us(directory, replay->next_index);
    if (directory->due_us < now_us()) {
        directory->due_us = now_us();
    }
    if (!set_timer(directory)) {
        hal_fail(error, "the timer cannot be set: %s", strerror(errno));
        if (next == HAL_NEXT_FRAME) {
            directory->camera.release(directory, frame);
        }
        return HAL_NEXT_GONE;
    }
    return next;
}

static void release_frame(void *context, const struct hal_frame *frame)
{
    struct hal_directory *directory = context;
    const struct hal_camera *camera = &directory->replay.camera;
    camera->release(camera->context, frame);
    directory->hold[frame->buffer_index].used = false;
}

static bool set_exposure(void *context, int32_t exposure_us, struct hal_error *error)
{
    (void)context;
    return hal_fail(error, "%d us: the frames of a directory were exposed before", exposure_us);
}

/* The mean step. */
static int32_t frame_time_us(void *context)
{
    const struct hal_directory *directory = context;
    int64_t count = (int64_t)directory->replay.entry_count; /* none before it was read */
    int64_t sum_us = 0;
    for (int64_t i = 1; i <= count; i++) {
        sum_us += step_us(directory, (size_t)i);
    }
    int64_t mean_us = count > 0 ? (sum_us + count / 2) / count : 0;
    return mean_us < HAL_DIRECTORY_STEP_MIN_US ? HAL_DIRECTORY_STEP_MIN_US : (int32_t)mean_us;
}

bool hal_directory_init(struct hal_directory *directory, const struct hal_directory_config *config,
                        const struct hal_log *log, struct hal_error *error)
{
    *directory = (struct hal_directory){
        .camera = {.context = directory,
                   .open = open_directory,
                   .close = close_directory,
                   .next = next_frame,
                   .release = release_frame,
                   .set_exposure = set_exposure,
                   .frame_time_us = frame_time_us,
                   .waits = true},
        .fd = -1,
        .config = *config,
    };
    return hal_replay_open(&directory->replay, config->path, false, log, error);
}

void hal_directory_free(struct hal_directory *directory)
{
    close_directory(directory);
    hal_replay_close(&directory->replay);
}
