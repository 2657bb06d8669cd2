#include "hal.h"

#include <stdarg.h>
#include <stdio.h>

bool hal_fail(struct hal_error *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}
