/* app_log and hal_log: what is reported, what is held back, and where it goes. */
#include "app_log.h"
#include "linux/hal_log.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include "app_terminal.h"
#include "ih_test.h"

#define LINES_MAX 64
#define SOCKET "test_log.socket"
#define SECOND INT64_C(1000000)

static struct app_log log_state;
static struct hal_log_writer writer;
static char line[LINES_MAX][APP_LOG_TEXT_MAX + 16];
static int line_count;

static void note(void *context, int level, const char *text)
{
    TEST_ASSERT_EQUAL_PTR(&line, context);
    TEST_ASSERT_LESS_THAN_INT(LINES_MAX, line_count);
    TEST_ASSERT_LESS_THAN_UINT64(APP_LOG_TEXT_MAX, strlen(text));
    snprintf(line[line_count++], sizeof line[0], "%d %s", level, text);
}

void setUp(void)
{
    alarm(60);
    line_count = 0;
    memset(&log_state, IH_TEST_FILL, sizeof log_state);
    app_log_init(&log_state, note, &line, 0);
    remove(SOCKET);
    unsetenv("JOURNAL_STREAM");
}

void tearDown(void)
{
    remove(SOCKET);
}

static void messages_have_level_and_text(void)
{
    app_log_say(&log_state, APP_LOG_ERROR, "camera: %s", "gone");
    app_log_say(&log_state, APP_LOG_WARNING, "%d of %d", 3, 4);
    app_log_report(&log_state, APP_LOG_INFO, "50 % done");
    TEST_ASSERT_EQUAL_INT(3, line_count);
    TEST_ASSERT_EQUAL_STRING("3 camera: gone", line[0]);
    TEST_ASSERT_EQUAL_STRING("4 3 of 4", line[1]);
    TEST_ASSERT_EQUAL_STRING("6 50 % done", line[2]);
}

static void the_same_kind_is_held_back_and_reported_later(void)
{
    int i;

    for (i = 1; i <= 42; i++) {
        app_log_time(&log_state, i * SECOND);
        app_log_say(&log_state, APP_LOG_WARNING, "frame %d", i);
    }
    TEST_ASSERT_EQUAL_INT(APP_LOG_BURST, line_count);
    TEST_ASSERT_EQUAL_STRING("4 frame 5", line[4]);
    /* Others are not held back for it, not even of the same text. */
    app_log_say(&log_state, APP_LOG_ERROR, "frame %d", 43);
    app_log_say(&log_state, APP_LOG_WARNING, "Frame %d", 44);
    TEST_ASSERT_EQUAL_INT(7, line_count);
    /* The interval starts with the first one. */
    app_log_time(&log_state, SECOND + APP_LOG_INTERVAL_US - 1);
    TEST_ASSERT_EQUAL_INT(7, line_count);
    app_log_time(&log_state, SECOND + APP_LOG_INTERVAL_US);
    TEST_ASSERT_EQUAL_INT(8, line_count);
    TEST_ASSERT_EQUAL_STRING("4 frame 42 (last of 37 held back in 60 s)", line[7]);
    /* And all starts anew; without any held back there is nothing to tell. */
    app_log_say(&log_state, APP_LOG_WARNING, "frame %d", 45);
    TEST_ASSERT_EQUAL_STRING("4 frame 45", line[8]);
    app_log_time(&log_state, 1000 * SECOND);
    TEST_ASSERT_EQUAL_INT(9, line_count);
    app_log_end(&log_state);
    TEST_ASSERT_EQUAL_INT(9, line_count);
}

/* A format is a kind by its letters: the same one of two source files, or of two calls. */
static void a_kind_is_known_by_its_letters(void)
{
    const char one[] = "x %d";
    const char other[] = "x %d";
    int i;

    for (i = 0; i < APP_LOG_BURST; i++) {
        app_log_say(&log_state, APP_LOG_INFO, one, i);
        app_log_say(&log_state, APP_LOG_INFO, other, i);
    }
    TEST_ASSERT_EQUAL_INT(APP_LOG_BURST, line_count);
}

static void the_end_tells_what_is_held_back(void)
{
    int i;

    for (i = 0; i < APP_LOG_BURST + 1; i++) {
        app_log_say(&log_state, APP_LOG_ERROR, "again");
    }
    app_log_time(&log_state, 7 * SECOND);
    app_log_end(&log_state);
    TEST_ASSERT_EQUAL_INT(APP_LOG_BURST + 1, line_count);
    TEST_ASSERT_EQUAL_STRING("3 again (last of 1 held back in 7 s)", line[APP_LOG_BURST]);
    app_log_end(&log_state);
    TEST_ASSERT_EQUAL_INT(APP_LOG_BURST + 1, line_count);
}

/* More kinds than there is room for share one entry; of those the worst held back is reported. */
static void more_kinds_than_room_share_one(void)
{
    static char format[APP_LOG_KINDS_MAX + 20][8];
    int i;

    for (i = 0; i < APP_LOG_KINDS_MAX + 20; i++) {
        snprintf(format[i], sizeof format[i], "k%d %%d", i);
        app_log_say(&log_state, i == APP_LOG_KINDS_MAX + 10 ? APP_LOG_ERROR : APP_LOG_INFO,
                    format[i], 0);
    }
    TEST_ASSERT_EQUAL_INT(APP_LOG_KINDS_MAX + APP_LOG_BURST, line_count);
    app_log_time(&log_state, APP_LOG_INTERVAL_US);
    TEST_ASSERT_EQUAL_INT(APP_LOG_KINDS_MAX + APP_LOG_BURST + 1, line_count);
    TEST_ASSERT_EQUAL_STRING("3 k26 0 (last of 15 held back in 60 s)", line[line_count - 1]);
}

static void texts_are_tamed_and_cut(void)
{
    static char text[4 * APP_LOG_TEXT_MAX];
    int i;

    app_log_say(&log_state, APP_LOG_ERROR, "a\033[2J\nb%s", "\x7f");
    TEST_ASSERT_EQUAL_STRING("3 a?[2J?b?", line[0]);
    memset(text, 'x', sizeof text - 1);
    app_log_report(&log_state, APP_LOG_ERROR, text);
    TEST_ASSERT_EQUAL_UINT64(2 + APP_LOG_TEXT_MAX - 1, strlen(line[1]));
    for (i = 0; i < APP_LOG_BURST + 3; i++) {
        app_log_say(&log_state, APP_LOG_ERROR, "%s", text);
    }
    app_log_end(&log_state);
    TEST_ASSERT_EQUAL_UINT64(2 + APP_LOG_TEXT_MAX - 1, strlen(line[line_count - 1]));
    TEST_ASSERT_NOT_NULL(strstr(line[line_count - 1], "x (last of 3 held back in 0 s)"));
}

/* From here on: where it goes. */

static void write_to(int descriptor, int level, const char *text)
{
    int own = dup(STDERR_FILENO);

    dup2(descriptor, STDERR_FILENO);
    hal_log_write(&writer, level, text);
    dup2(own, STDERR_FILENO);
    close(own);
}

static void open_on(int descriptor, const char *socket_path)
{
    int own = dup(STDERR_FILENO);

    dup2(descriptor, STDERR_FILENO);
    hal_log_open(&writer, "test", socket_path);
    dup2(own, STDERR_FILENO);
    close(own);
}

/* All that is there, as a text. */
static const char *take(int descriptor)
{
    static char text[1 << 17];
    ssize_t count;

    fcntl(descriptor, F_SETFL, O_NONBLOCK);
    count = read(descriptor, text, sizeof text - 1);
    text[count > 0 ? count : 0] = 0;
    return text;
}

static void standard_error_gets_lines(void)
{
    char journal[64];
    struct stat status;
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_on(ends[1], NULL);
    write_to(ends[1], 3, "one");
    write_to(ends[1], 6, "two %s");
    TEST_ASSERT_EQUAL_STRING("test: one\ntest: two %s\n", take(ends[0]));
    /* The journal of somebody else: systemd sets it for all that a service starts. */
    setenv("JOURNAL_STREAM", "1:2", 1);
    open_on(ends[1], NULL);
    write_to(ends[1], 3, "one");
    TEST_ASSERT_EQUAL_STRING("test: one\n", take(ends[0]));
    TEST_ASSERT_EQUAL_INT(0, fstat(ends[1], &status));
    snprintf(journal, sizeof journal, "%llu:%llu", (unsigned long long)status.st_dev,
             (unsigned long long)status.st_ino);
    setenv("JOURNAL_STREAM", journal, 1);
    open_on(ends[1], NULL);
    write_to(ends[1], 3, "one");
    write_to(ends[1], 6, "two");
    TEST_ASSERT_EQUAL_STRING("<3>one\n<6>two\n", take(ends[0]));
    close(ends[0]);
    close(ends[1]);
}

static void a_reader_that_is_slow_or_gone_holds_nobody_up(void)
{
    int ends[2];
    int i;

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_on(ends[1], NULL);
    for (i = 0; i < 20000; i++) {
        write_to(ends[1], 3, "a message of some length that fills the pipe sooner");
    }
    TEST_ASSERT_GREATER_THAN_INT64(10000, writer.dropped_count);
    TEST_ASSERT_LESS_THAN_INT64(20000, writer.dropped_count);
    i = (int)writer.dropped_count;
    TEST_ASSERT_EQUAL_INT(0, strncmp("test: a message", take(ends[0]), 15));
    write_to(ends[1], 3, "last");
    snprintf(line[0], sizeof line[0],
             "test: %d messages were lost: the log was not read in time\ntest: last\n", i);
    TEST_ASSERT_EQUAL_STRING(line[0], take(ends[0]));
    TEST_ASSERT_EQUAL_INT64(0, writer.dropped_count);
    close(ends[0]);
    write_to(ends[1], 3, "nobody");
    TEST_ASSERT_EQUAL_INT64(1, writer.dropped_count);
    close(ends[1]);
}

/* Somebody typed ^S. */
static void a_stopped_terminal_holds_nobody_up(void)
{
    int master = terminal_open();
    int slave, i;

    slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, slave);
    open_on(slave, NULL);
    TEST_ASSERT_EQUAL_INT(0, tcflow(slave, TCOOFF));
    write_to(slave, 3, "stopped");
    TEST_ASSERT_EQUAL_INT64(1, writer.dropped_count);
    TEST_ASSERT_EQUAL_INT(0, tcflow(slave, TCOON));
    /* And one that nobody reads. */
    memset(line, 'x', sizeof line[0]);
    line[0][APP_LOG_TEXT_MAX - 1] = 0;
    writer.dropped_count = 0;
    while (writer.dropped_count == 0) {
        write_to(slave, 3, line[0]);
    }
    for (i = 0; i < 100; i++) {
        write_to(slave, 3, line[0]);
    }
    close(slave);
    close(master);
}

static int start_daemon(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX, .sun_path = SOCKET};
    int daemon = socket(AF_UNIX, SOCK_DGRAM, 0);

    remove(SOCKET);
    TEST_ASSERT_EQUAL_INT(0, bind(daemon, (struct sockaddr *)&address, sizeof address));
    return daemon;
}

static void syslog_gets_datagrams(void)
{
    char wanted[64];
    const char *text;
    int ends[2];
    int daemon;

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_on(ends[1], SOCKET);
    /* Not there yet. */
    write_to(ends[1], 3, "early");
    TEST_ASSERT_EQUAL_STRING("test: early\n", take(ends[0]));
    daemon = start_daemon();
    write_to(ends[1], 4, "one %s");
    text = take(daemon);
    /* "<28>Jan  1 00:00:00 test[PID]: one %s": 28 is facility 3, level 4. */
    TEST_ASSERT_EQUAL_INT(0, strncmp("<28>", text, 4));
    snprintf(wanted, sizeof wanted, " test[%ld]: one %%s", (long)getpid());
    TEST_ASSERT_EQUAL_UINT64(4 + 15 + strlen(wanted), strlen(text));
    TEST_ASSERT_EQUAL_STRING(wanted, text + 4 + 15);
    /* Started anew. */
    close(daemon);
    daemon = start_daemon();
    write_to(ends[1], 6, "two");
    TEST_ASSERT_NOT_NULL(strstr(take(daemon), "]: two"));
    close(daemon);
    write_to(ends[1], 6, "three");
    TEST_ASSERT_EQUAL_STRING("test: three\n", take(ends[0]));
    TEST_ASSERT_EQUAL_INT64(0, writer.dropped_count);
    hal_log_close(&writer);
    close(ends[0]);
    close(ends[1]);
}

/* syslog() itself would wait here for ever. */
static void a_daemon_that_hangs_holds_nobody_up(void)
{
    int ends[2];
    int daemon = start_daemon();
    int i;

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_on(ends[1], SOCKET);
    for (i = 0; i < 2000; i++) {
        write_to(ends[1], 3, "message");
    }
    TEST_ASSERT_NOT_NULL(strstr(take(daemon), "message"));
    TEST_ASSERT_NOT_NULL(strstr(take(ends[0]), "test: message\n"));
    hal_log_close(&writer);
    close(daemon);
    close(ends[0]);
    close(ends[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(messages_have_level_and_text);
    RUN_TEST(the_same_kind_is_held_back_and_reported_later);
    RUN_TEST(a_kind_is_known_by_its_letters);
    RUN_TEST(the_end_tells_what_is_held_back);
    RUN_TEST(more_kinds_than_room_share_one);
    RUN_TEST(texts_are_tamed_and_cut);
    RUN_TEST(standard_error_gets_lines);
    RUN_TEST(a_reader_that_is_slow_or_gone_holds_nobody_up);
    RUN_TEST(a_stopped_terminal_holds_nobody_up);
    RUN_TEST(syslog_gets_datagrams);
    RUN_TEST(a_daemon_that_hangs_holds_nobody_up);
    return UNITY_END();
}
