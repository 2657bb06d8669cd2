/* isohead_board - heads from a camera and a laser, live. */
#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include "app_board.h"
#include "app_config.h"

/* The only instances. */
static struct app_config config;
static struct app_board board;

/* A stream that the caller closed would give its number to the next file that is opened: the camera
 * could get the records. */
static void occupy_streams(void)
{
    int descriptor = 0;
    do {
        descriptor = open("/dev/null", O_RDWR);
    } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
    if (descriptor > STDERR_FILENO) {
        close(descriptor);
    }
}

static void print_error(void *context, const char *subject, const char *text)
{
    (void)context;
    fprintf(stderr, "isohead_board: %s: %s\n", subject, text);
}

int main(int argument_count, char **arguments)
{
    const struct hal_log errors = {.error = print_error};
    occupy_streams();
    bool good = app_config_read(&config, argument_count, arguments, &errors);
    if (config.laser_off) {
        /* Even with a configuration that is wrong elsewhere. */
        enum app_exit exit = app_board_laser_off(&board, &config);
        return good ? (int)exit : APP_EXIT_USAGE;
    }
    if (!good) {
        return APP_EXIT_USAGE;
    }
    if (config.help || config.version) {
        if (config.help) {
            app_config_help(stdout);
        } else {
            puts("isohead_board " ISOHEAD_VERSION);
        }
        if (fflush(stdout) != 0 || ferror(stdout)) {
            perror("isohead_board: standard output");
            return APP_EXIT_FAILED;
        }
        return APP_EXIT_GOOD;
    }
    return (int)app_board_run(&board, &config);
}
