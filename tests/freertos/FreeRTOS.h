/* As much of FreeRTOS as the example needs; test.c does what it stands for. */
#ifndef FREERTOS_H
#define FREERTOS_H

#include <stdint.h>

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
typedef const void *TaskHandle_t;

#define pdFALSE 0
#define pdTRUE 1
#define pdPASS 1
#define tskIDLE_PRIORITY 0
#define pdMS_TO_TICKS(ms) ((TickType_t)(ms))
#define portYIELD_FROM_ISR(woken) ((void)(woken))

BaseType_t xTaskCreate(void (*code)(void *), const char *name, uint16_t stack_words,
                       void *parameter, UBaseType_t priority, TaskHandle_t *handle);
TickType_t xTaskGetTickCount(void);
void vTaskDelete(TaskHandle_t handle);
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks);
void vTaskNotifyGiveFromISR(TaskHandle_t handle, BaseType_t *woken);

#endif
