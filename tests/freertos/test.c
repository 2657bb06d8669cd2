/* The example of a task, with stubs of FreeRTOS and of a board: a rig that is damaged, frames until the camera stops,
 * and frames that are refused.
 *
 *     test RIG_BLOB FRAME_PGM      a frame of 320x240 with a head in it */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "FreeRTOS.h"
#include "detect/ih_detections.h"
#include "isohead.h"
#include "rig/ih_rig_blob.h"
#include "tracks/ih_result.h"

#define FRAMES 12
#define FRAME_BYTES (320 * 240)
#define PERIOD_TICKS 40
/* Of docs/safety.md. */
#define LASER_CAP_TICKS 200

BaseType_t isohead_task_create(void);
void camera_interrupt(void);
void camera_start(uint8_t *frame);
void camera_stop(void);
int64_t camera_time_us(void);
void head_found(const struct ih_result_entry *head, int64_t time_us);
void laser_off(void);

uint8_t rig_blob[IH_RIG_BLOB_BYTES];
static uint8_t content[FRAME_BYTES];
static uint8_t *waiting;
static void (*task)(void *);
static int frame_count, given, called_count, found_count, off_count, deleted_count;
static int frames_max, good_max; /* the camera stops, and frames are refused, after so many */
static bool is_running;
static TickType_t now_ticks, good_ticks, off_ticks;

enum ih_err __real_isohead_frame(struct isohead *head, const struct ih_frame *frame,
                                 const struct ih_frame *ambient, int64_t time_us);
enum ih_err __wrap_isohead_frame(struct isohead *head, const struct ih_frame *frame,
                                 const struct ih_frame *ambient, int64_t time_us);

BaseType_t xTaskCreate(void (*code)(void *), const char *name, uint16_t stack_words,
                       void *parameter, UBaseType_t priority, TaskHandle_t *handle)
{
    (void)name, (void)parameter, (void)priority;
    task = code;
    *handle = &task;
    return stack_words >= 1024 ? pdPASS : pdFALSE;
}

void vTaskDelete(TaskHandle_t handle)
{
    deleted_count += handle == NULL;
}

void vTaskNotifyGiveFromISR(TaskHandle_t handle, BaseType_t *woken)
{
    given += handle == &task;
    *woken = pdTRUE;
}

TickType_t xTaskGetTickCount(void)
{
    return now_ticks;
}

/* The camera fills what it was given, and stops after a while. */
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks)
{
    if (frame_count < frames_max && clear == pdTRUE && ticks >= PERIOD_TICKS) {
        memcpy(waiting, content, sizeof content);
        frame_count++;
        now_ticks += PERIOD_TICKS;
        camera_interrupt();
    } else {
        now_ticks += ticks;
    }
    uint32_t count = (uint32_t)given;
    given = 0;
    return count;
}

/* The other buffer each time. */
void camera_start(uint8_t *frame)
{
    if (frame == waiting) {
        puts("FAIL: the buffer that is looked at is filled again");
        exit(1);
    }
    waiting = frame;
    is_running = true;
}

void camera_stop(void)
{
    is_running = false;
}

enum ih_err __wrap_isohead_frame(struct isohead *head, const struct ih_frame *frame,
                                 const struct ih_frame *ambient, int64_t time_us)
{
    if (frame_count > good_max) {
        return IH_ERR_SIZE;
    }
    good_ticks = now_ticks;
    return __real_isohead_frame(head, frame, ambient, time_us);
}

int64_t camera_time_us(void)
{
    return frame_count * INT64_C(40000);
}

void head_found(const struct ih_result_entry *head, int64_t time_us)
{
    called_count += time_us == camera_time_us();
    found_count += head != NULL;
}

void laser_off(void)
{
    off_count++;
    off_ticks = now_ticks;
}

static void load(const char *path, void *to, size_t count, long from_end)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL || fseek(file, -from_end, SEEK_END) != 0 ||
        fread(to, 1, count, file) != count) {
        perror(path);
        exit(1);
    }
    fclose(file);
}

/* The task from its start to its end, with a camera that goes on for so many frames. */
static void run_task(int frames, int good_frames)
{
    frame_count = called_count = found_count = off_count = deleted_count = given = 0;
    frames_max = frames;
    good_max = good_frames;
    good_ticks = now_ticks;
    waiting = NULL;
    task(NULL);
    if (off_count != 1 || deleted_count != 1 || off_ticks - good_ticks > LASER_CAP_TICKS) {
        printf("FAIL: laser off %d times, %u ticks after the last good frame; deleted %d times\n",
               off_count, (unsigned)(off_ticks - good_ticks), deleted_count);
        exit(1);
    }
    if (is_running) {
        puts("FAIL: the camera goes on: its interrupt notifies a task that is gone");
        exit(1);
    }
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 3 || isohead_task_create() != pdPASS) {
        return 2;
    }
    load(arguments[1], rig_blob, sizeof rig_blob, (long)sizeof rig_blob);
    load(arguments[2], content, sizeof content, (long)sizeof content);
    rig_blob[100] ^= 1;
    run_task(FRAMES, FRAMES);
    if (frame_count != 0) {
        puts("FAIL: a damaged rig");
        return 1;
    }
    rig_blob[100] ^= 1;
    run_task(INT32_MAX, 1);
    if (called_count != 1) {
        printf("FAIL: %d of 1 good frame\n", called_count);
        return 1;
    }
    run_task(FRAMES, FRAMES);
    if (called_count != FRAMES || found_count < FRAMES / 2) {
        printf("FAIL: %d of %d frames, %d with a head\n", called_count, FRAMES, found_count);
        return 1;
    }
    printf("%d frames, %d with a head; laser off when they ended, or were refused\n", called_count,
           found_count);
    return 0;
}
