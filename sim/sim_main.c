/* host_sim - recorded or rendered frames through isohead on a workstation. */
#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include "sim_options.h"
#include "sim_run.h"

/* The only instance. */
static struct isohead head;

/* A stream that the caller closed would give its number to the next file that is opened, and
 * records or messages would end up there. One that cannot be written makes them fail instead. */
static void occupy_streams(void)
{
    int descriptor = 0;
    do {
        descriptor = open("/dev/null", O_RDONLY);
    } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
    if (descriptor > STDERR_FILENO) {
        close(descriptor);
    }
}

int main(int argument_count, char **arguments)
{
    struct sim_options options;
    occupy_streams();
    if (!sim_options_parse(&options, argument_count, arguments)) {
        return SIM_STATUS_USAGE;
    }
    if (options.help || options.version) {
        if (options.help) {
            sim_options_help();
        } else {
            puts("host_sim " ISOHEAD_VERSION);
        }
        if (fflush(stdout) != 0) {
            perror("host_sim: standard output");
            return SIM_STATUS_INPUT;
        }
        return SIM_STATUS_GOOD;
    }
    return (int)sim_run(&options, &head);
}
