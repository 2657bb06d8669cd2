/* tool_error - what ends a run: a message that says what was wrong, where, and what to do about it.
 */
#ifndef TOOL_ERROR_HPP
#define TOOL_ERROR_HPP

#include <cstdarg>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace tool
{
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

__attribute__((format(printf, 1, 2))) inline std::string text(const char *format, ...)
{
    char buffer[2048];
    va_list values;
    va_start(values, format);
    std::vsnprintf(buffer, sizeof buffer, format, values);
    va_end(values);
    return buffer;
}
} // namespace tool

#endif
