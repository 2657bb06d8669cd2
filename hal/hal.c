#include "hal.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool hal_fail(struct hal_error *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

void hal_add(struct hal_error *error, const char *text)
{
    size_t length = strlen(error->text);
    snprintf(error->text + length, sizeof error->text - length, "%s%s", length > 0 ? "; " : "",
             text);
}
