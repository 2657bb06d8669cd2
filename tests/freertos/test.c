/* The example of a task, with stubs of FreeRTOS and of a board: a rig that is damaged, and frames until the camera stops.
 *
 *     test RIG_BLOB FRAME_PGM      a frame of 320x240 with a head in it */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "FreeRTOS.h"
#include "detect/ih_detections.h"
#include "rig/ih_rig_blob.h"
#include "tracks/ih_result.h"

#define FRAMES 12
#define FRAME_BYTES (320 * 240)

BaseType_t isohead_task_create(void);
void camera_interrupt(void);
void camera_start(uint8_t *frame);
int64_t camera_time_us(void);
void head_found(const struct ih_result_entry *head, int64_t time_us);
void laser_off(void);

uint8_t rig_blob[IH_RIG_BLOB_BYTES];
static uint8_t content[FRAME_BYTES];
static uint8_t *waiting;
static void (*task)(void *);
static int frame_count, given, called_count, found_count, off_count, deleted_count;

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

/* The camera fills what it was given, and stops after a while. */
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks)
{
    if (frame_count < FRAMES && clear == pdTRUE && ticks > 0) {
        memcpy(waiting, content, sizeof content);
        frame_count++;
        camera_interrupt();
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

int main(int argument_count, char **arguments)
{
    if (argument_count != 3 || isohead_task_create() != pdPASS) {
        return 2;
    }
    load(arguments[1], rig_blob, sizeof rig_blob, (long)sizeof rig_blob);
    load(arguments[2], content, sizeof content, (long)sizeof content);
    rig_blob[100] ^= 1;
    task(NULL);
    if (off_count != 1 || deleted_count != 1 || frame_count != 0) {
        puts("FAIL: a damaged rig");
        return 1;
    }
    rig_blob[100] ^= 1;
    task(NULL);
    if (off_count != 2 || deleted_count != 2 || called_count != FRAMES ||
        found_count < FRAMES / 2) {
        printf("FAIL: off %d times, %d of %d frames, %d with a head\n", off_count, called_count,
               FRAMES, found_count);
        return 1;
    }
    printf("%d frames, %d with a head; laser off when they ended\n", called_count, found_count);
    return 0;
}
