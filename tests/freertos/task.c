/* An example: isohead as a task of FreeRTOS (docs/microcontroller.md). The camera's interrupt says when a frame is whole; one
 * buffer is filled while the other is looked at. What a board has to bring: the functions declared here without a body. */
#include <stdbool.h>

#include "FreeRTOS.h"
#include "isohead.h"
#include "rig/ih_rig_blob.h"
#include "task.h"

#define WIDTH 320
#define HEIGHT 240
/* Words: 2.3 kB of the core, and what the calls above it and the interrupts need. */
#define STACK_WORDS 1024
/* As laser-cap in docs/safety.md. */
#define LASER_CAP_MS 200

extern const uint8_t rig_blob[IH_RIG_BLOB_BYTES]; /* in flash, written by rigblob */
void camera_start(uint8_t *frame);                /* DMA of the next frame */
void camera_stop(void);                           /* no DMA and no interrupt comes after it */
int64_t camera_time_us(void);                     /* of the frame that was filled last */
void head_found(const struct ih_result_entry *head, int64_t time_us); /* NULL: nobody */
void laser_off(void);

/* What a board calls: from the interrupt's vector, and from main. */
void camera_interrupt(void);
BaseType_t isohead_task_create(void);

static struct isohead head;               /* the largest piece: SRAM with a cache */
static uint8_t frames[2][WIDTH * HEIGHT]; /* where the camera's DMA can write */
static struct ih_calibration calibration; /* 4.5 kB that are free after the start */
static TaskHandle_t task;

/* The camera's interrupt: the frame is whole. */
void camera_interrupt(void)
{
    BaseType_t woken = pdFALSE;
    vTaskNotifyGiveFromISR(task, &woken);
    portYIELD_FROM_ISR(woken);
}

/* False: the frame was refused, and shows nothing. */
static bool look(const uint8_t *samples, int64_t time_us)
{
    const struct ih_frame frame = {.samples = samples,
                                   .width = WIDTH,
                                   .height = HEIGHT,
                                   .stride_bytes = WIDTH,
                                   .bytes_per_sample = 1,
                                   .maximum = 255};
    if (isohead_frame(&head, &frame, NULL, time_us) != IH_OK) {
        return false;
    }
    const int32_t selected = head.result.selected;
    head_found(selected == IH_NONE ? NULL : &head.result.entry[selected], time_us);
    return true;
}

/* Waits for a frame; false when LASER_CAP_MS have passed since the last one that was judged. */
static bool wait_for_frame(TickType_t judged_ticks)
{
    const TickType_t passed = xTaskGetTickCount() - judged_ticks;
    return passed < pdMS_TO_TICKS(LASER_CAP_MS) &&
           ulTaskNotifyTake(pdTRUE, pdMS_TO_TICKS(LASER_CAP_MS) - passed) != 0;
}

static void run(void *unused)
{
    int filled = 0;
    int32_t bad_slot = IH_NONE;
    (void)unused;
    if (ih_rig_blob_decode(rig_blob, IH_RIG_BLOB_BYTES, &calibration) != IH_OK ||
        isohead_init(&head, &calibration, &bad_slot) != IH_OK) {
        laser_off(); /* nothing that is measured would mean anything */
        vTaskDelete(NULL);
        return;
    }
    camera_start(frames[filled]);
    /* Without a frame that was judged nobody looks, and the laser must not go on. */
    TickType_t judged_ticks = xTaskGetTickCount();
    while (wait_for_frame(judged_ticks)) {
        const int64_t time_us = camera_time_us();
        const uint8_t *samples = frames[filled];
        filled = 1 - filled;
        camera_start(frames[filled]);
        if (look(samples, time_us)) {
            judged_ticks = xTaskGetTickCount();
        }
    }
    laser_off();
    camera_stop(); /* its interrupt would notify a task that is gone */
    vTaskDelete(NULL);
}

/* Call once, before the scheduler starts. */
BaseType_t isohead_task_create(void)
{
    return xTaskCreate(run, "isohead", STACK_WORDS, NULL, tskIDLE_PRIORITY + 1, &task);
}
