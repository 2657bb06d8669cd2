/* hal_startup - from reset to main; a fault ends the program. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "cortexm/hal_semihosting.h"

#define STATUS_FAULT 3
/* System exceptions of every Cortex-M after the first stack pointer; interrupts are not used. */
#define VECTORS 15

/* Set by sections.ld. */
extern uint32_t hal_data_start[], hal_data_end[], hal_bss_start[], hal_bss_end[], hal_stack_top[];
extern const uint32_t hal_data_load[];

int main(void);
void hal_reset(void);

static void fault(void)
{
    static const char text[] = "fault: an exception that nothing here causes\n";
    hal_semihosting_write(text, sizeof text - 1);
    hal_semihosting_exit(STATUS_FAULT);
}

void hal_reset(void)
{
    memcpy(hal_data_start, hal_data_load,
           (size_t)((const char *)hal_data_end - (const char *)hal_data_start));
    memset(hal_bss_start, 0, (size_t)((const char *)hal_bss_end - (const char *)hal_bss_start));
    hal_semihosting_exit(main());
}

struct vectors {
    uint32_t *stack_top;
    void (*handler[VECTORS])(void);
};

extern const struct vectors hal_vectors;
__attribute__((section(".vectors"), used))
const struct vectors hal_vectors = {hal_stack_top,
                                    {hal_reset, fault, fault, fault, fault, fault, fault, fault,
                                     fault, fault, fault, fault, fault, fault, fault}};
