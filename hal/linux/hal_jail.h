/* hal_jail - what a process that talks to strangers gives up before it does.
 *
 * After this it cannot open a file or device, start a program, send a signal, look into another
 * process or open a socket: it has what it was given, and may accept, read, write and end. Whatever else
 * it asks the kernel for is EPERM. It gets the processor when nobody else wants it (SCHED_IDLE), never
 * gains rights by starting something, leaves no core, and as root becomes "nobody" first.
 * A member of the group of GPIO chips stays in it, since that takes a right that a service has not;
 * without opening anything that is worth nothing.
 * Once, with one thread, before the first byte from outside is read.
 */
#ifndef HAL_JAIL_H
#define HAL_JAIL_H

#include "hal.h"

/* False: *error, and it is as free as before in what came later in the list above. */
bool hal_jail_enter(struct hal_error *error);

#endif
