#include "linux/hal_log.h"

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <syslog.h>
#include <time.h>
#include <unistd.h>

#include "linux/hal_shared.h"

/* Longest line with all that stands before its text. */
#define LINE_MAX_BYTES 1024

/* systemd says which device and inode the journal's end has. */
static bool leads_to_journal(int descriptor)
{
    struct stat status;
    char own[64];
    const char *journal = getenv("JOURNAL_STREAM");
    if (journal == NULL || fstat(descriptor, &status) != 0) {
        return false;
    }
    snprintf(own, sizeof own, "%ju:%ju", (uintmax_t)status.st_dev, (uintmax_t)status.st_ino);
    return strcmp(journal, own) == 0;
}

/* What standard error does not take at once is lost. */
static bool write_now(const char *line, size_t count)
{
    size_t done = 0;
    ssize_t written = 0;
    while (done < count &&
           (written = hal_shared_write(STDERR_FILENO, line + done, count - done)) > 0) {
        done += (size_t)written;
    }
    return done > 0;
}

static bool write_stderr(const struct hal_log_writer *writer, int level, const char *text)
{
    char line[LINE_MAX_BYTES];
    int length = writer->journal ? snprintf(line, sizeof line, "<%d>%s", level, text)
                                 : snprintf(line, sizeof line, "%s: %s", writer->program, text);
    size_t count = length < (int)sizeof line ? (size_t)length : sizeof line - 1;
    line[count] = '\n';
    return write_now(line, count + 1);
}

static void disconnect(struct hal_log_writer *writer)
{
    if (writer->descriptor >= 0) {
        close(writer->descriptor);
    }
    writer->descriptor = -1;
}

static bool connect_syslog(struct hal_log_writer *writer)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(writer->socket_path) >= sizeof address.sun_path) {
        return false;
    }
    memcpy(address.sun_path, writer->socket_path, strlen(writer->socket_path) + 1);
    writer->descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (writer->descriptor >= 0 &&
        connect(writer->descriptor, (const struct sockaddr *)&address, sizeof address) == 0) {
        return true;
    }
    disconnect(writer);
    return false;
}

/* A daemon that was started anew has another socket of the same name: once more, then. */
static bool write_syslog(struct hal_log_writer *writer, int level, const char *text)
{
    char line[LINE_MAX_BYTES];
    char date[32] = "";
    struct tm local;
    time_t now = time(NULL);
    if (localtime_r(&now, &local) != NULL) {
        (void)strftime(date, sizeof date, "%b %e %H:%M:%S ", &local);
    }
    int length = snprintf(line, sizeof line, "<%d>%s%s[%ld]: %s", LOG_DAEMON | level, date,
                          writer->program, (long)getpid(), text);
    size_t count = length < (int)sizeof line ? (size_t)length : sizeof line - 1;
    for (int attempt = 0; attempt < 2; attempt++) {
        if (writer->descriptor < 0 && !connect_syslog(writer)) {
            return false;
        }
        if (send(writer->descriptor, line, count, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) {
            return true;
        }
        if (errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS) {
            return false;
        }
        disconnect(writer);
    }
    return false;
}

static bool write_line(struct hal_log_writer *writer, int level, const char *text)
{
    return (writer->socket_path != NULL && write_syslog(writer, level, text)) ||
           write_stderr(writer, level, text);
}

void hal_log_open(struct hal_log_writer *writer, const char *program, const char *socket_path)
{
    signal(SIGPIPE, SIG_IGN);
    *writer = (struct hal_log_writer){
        .program = program,
        .journal = leads_to_journal(STDERR_FILENO),
        .socket_path = socket_path,
        .descriptor = -1,
    };
}

void hal_log_close(struct hal_log_writer *writer)
{
    disconnect(writer);
}

void hal_log_write(void *context, int level, const char *text)
{
    struct hal_log_writer *writer = context;
    if (writer->dropped_count > 0) {
        char reported[80];
        snprintf(reported, sizeof reported,
                 "%" PRId64 " messages were lost: the log was not read in time",
                 writer->dropped_count);
        if (write_line(writer, LOG_WARNING, reported)) {
            writer->dropped_count = 0;
        }
    }
    if (!write_line(writer, level, text)) {
        writer->dropped_count++;
    }
}
