/* In builds that count what is run: a process that ends without the C library's exit, as guards do and whoever is killed by
 * his own signal, or becomes another program, leaves its counts too. The linker puts these in place of the calls. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdarg.h>
#include <sys/syscall.h>
#include <unistd.h>

void __gcov_dump(void);
void __gcov_reset(void);
void __real__exit(int status) __attribute__((noreturn));
void __wrap__exit(int status) __attribute__((noreturn));
int __real_execv(const char *path, char *const arguments[]);
int __wrap_execv(const char *path, char *const arguments[]);
long __real_syscall(long number, ...);
long __wrap_syscall(long number, ...);
int __real_raise(int number);
int __wrap_raise(int number);

void __wrap__exit(int status)
{
    __gcov_dump();
    __real__exit(status);
}

int __wrap_raise(int number)
{
    __gcov_dump();
    __gcov_reset(); /* where the signal ends nothing */
    return __real_raise(number);
}

int __wrap_execv(const char *path, char *const arguments[])
{
    __gcov_dump();
    __gcov_reset();
    return __real_execv(path, arguments);
}

long __wrap_syscall(long number, ...)
{
    long more[4];
    va_list list;
    va_start(list, number);
    for (int i = 0; i < 4; i++) {
        more[i] = va_arg(list, long);
    }
    va_end(list);
    if (number == SYS_rt_tgsigqueueinfo) {
        __gcov_dump();
        __gcov_reset();
    }
    return __real_syscall(number, more[0], more[1], more[2], more[3]);
}
