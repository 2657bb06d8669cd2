/* hal_output: records leave whole or not at all, whatever the receiver does, and nobody waits.
 * Real pipes, terminals and sockets; a call that waits for ever ends in the alarm. */
#include "linux/hal_output.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "app_terminal.h"
#include "ih_test.h"

#define PATIENCE_S 120
#define SENT_MAX (1 << 20)
#define TTY_LINK "test_output.tty"
#define PLAIN_FILE "test_output.txt"

static struct hal_output_state state;
static struct hal_error error;
static int64_t now_us;
/* What was accepted, and what came out. */
static char sent[SENT_MAX], got[SENT_MAX];
static size_t sent_count, got_count;
/* A terminal makes two characters of a line's end. */
static bool doubled;

static int64_t report_time(void *context)
{
    (void)context;
    return now_us;
}

static const struct hal_clock test_clock = {NULL, report_time};

void setUp(void)
{
    alarm(PATIENCE_S);
    memset(&state, IH_TEST_FILL, sizeof state);
    memset(&error, 0, sizeof error);
    now_us = 5000000;
    sent_count = 0;
    got_count = 0;
    doubled = false;
    remove(TTY_LINK);
    remove(PLAIN_FILE);
}

void tearDown(void)
{
    remove(TTY_LINK);
    remove(PLAIN_FILE);
}

/* Unity reports on standard output too, so it leads elsewhere only for as long as a call takes. */
static int enter(int descriptor)
{
    int own = dup(STDOUT_FILENO);

    fflush(stdout);
    dup2(descriptor, STDOUT_FILENO);
    return own;
}

static void leave(int own)
{
    dup2(own, STDOUT_FILENO);
    close(own);
}

static void open_stdout(int descriptor)
{
    int own = enter(descriptor);
    bool good = hal_output_stdout(&state, &error);

    leave(own);
    TEST_ASSERT_TRUE_MESSAGE(good, error.text);
}

static enum hal_sent send_to(int descriptor, const char *bytes, size_t count)
{
    int own = enter(descriptor);
    enum hal_sent result = state.output.send(state.output.context, bytes, count, &error);

    leave(own);
    return result;
}

static void close_stdout(int descriptor)
{
    int own = enter(descriptor);

    hal_output_close(&state);
    leave(own);
}

/* Up to count bytes that are there now. */
static size_t drain(int descriptor, size_t count)
{
    size_t before = got_count;

    fcntl(descriptor, F_SETFL, O_NONBLOCK);
    while (got_count - before < count) {
        ssize_t bytes = read(descriptor, got + got_count, count - (got_count - before));
        if (bytes <= 0) {
            break;
        }
        got_count += (size_t)bytes;
    }
    return got_count - before;
}

/* Until so many have come in all: a terminal hands them on when it likes. */
static void drain_until(int descriptor, size_t count)
{
    while (got_count < count) {
        struct pollfd readable = {.fd = descriptor, .events = POLLIN};
        TEST_ASSERT_EQUAL_INT(1, poll(&readable, 1, -1));
        (void)drain(descriptor, SENT_MAX - got_count);
    }
    TEST_ASSERT_EQUAL_UINT64(count, got_count);
}

static void remember(const char *bytes, size_t count)
{
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(SENT_MAX, sent_count + count + 1);
    memcpy(sent + sent_count, bytes, count);
    sent_count += count;
    if (doubled) {
        memcpy(sent + sent_count - 1, "\r\n", 2);
        sent_count++;
    }
}

/* A record whose every byte says where it belongs. */
static size_t make_record(char *record, struct ih_test_random *random, size_t longest)
{
    size_t count = (size_t)ih_test_between(random, 1, (int64_t)longest);
    size_t i;

    for (i = 0; i + 1 < count; i++) {
        record[i] = (char)ih_test_between(random, 'a', 'z');
    }
    record[count - 1] = '\n';
    return count;
}

/* Readers of all speeds, at first none: what arrives is exactly what was accepted, in order. */
static void press(int writing, int reading, uint64_t seed, size_t longest)
{
    static char record[HAL_OUTPUT_RECORD_MAX];
    struct ih_test_random random = {seed};
    bool dropped = false;
    int round = 0;

    while (!dropped || (round < 600 && sent_count < SENT_MAX / 2)) {
        size_t count = make_record(record, &random, longest);
        enum hal_sent result = send_to(writing, record, count);
        TEST_ASSERT_NOT_EQUAL(HAL_SENT_NEVER, result);
        if (result == HAL_SENT) {
            remember(record, count);
        } else {
            TEST_ASSERT_EQUAL_STRING("its reader is slow", error.text);
            dropped = true;
        }
        if (dropped && ih_test_between(&random, 0, 3) == 0) {
            (void)drain(reading, (size_t)ih_test_between(&random, 1, 3 * (int64_t)longest));
            TEST_ASSERT_EQUAL_MEMORY(sent, got, got_count);
        }
        round++;
    }
    TEST_ASSERT_GREATER_THAN_UINT64(0, sent_count);
    /* What is kept goes out at the end when the reader has made room; closing again tries again. */
    while (state.unsent_count > 0) {
        drain_until(reading, sent_count - state.unsent_count - doubled);
        state.descriptor = STDOUT_FILENO;
        close_stdout(writing);
    }
    drain_until(reading, sent_count);
    TEST_ASSERT_EQUAL_MEMORY(sent, got, got_count);
}

static void a_pipe_gets_whole_records(void)
{
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_stdout(ends[1]);
    press(ends[1], ends[0], 1, 20000);
    /* It is shared with whoever gave it to us: not changed. */
    TEST_ASSERT_EQUAL_INT(0, fcntl(ends[1], F_GETFL) & O_NONBLOCK);
    close(ends[0]);
    close(ends[1]);
}

static void the_longest_records_pass_a_pipe_too(void)
{
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_stdout(ends[1]);
    press(ends[1], ends[0], 2, HAL_OUTPUT_RECORD_MAX);
    close(ends[0]);
    close(ends[1]);
}

static void a_pipe_that_somebody_made_non_blocking_works_too(void)
{
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    TEST_ASSERT_EQUAL_INT(0, fcntl(ends[1], F_SETFL, O_NONBLOCK));
    open_stdout(ends[1]);
    press(ends[1], ends[0], 3, 3000);
    close(ends[0]);
    close(ends[1]);
}

static void a_stream_socket_works_too(void)
{
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM, 0, ends));
    open_stdout(ends[1]);
    press(ends[1], ends[0], 4, 30000);
    close(ends[0]);
    close(ends[1]);
}

static int open_terminal(int *slave, bool raw)
{
    struct termios settings;
    int master = terminal_open();

    *slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, *slave);
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(*slave, &settings));
    settings.c_oflag = raw ? 0 : OPOST | ONLCR;
    TEST_ASSERT_EQUAL_INT(0, tcsetattr(*slave, TCSANOW, &settings));
    return master;
}

static void a_terminal_gets_whole_records(void)
{
    int slave;
    int master = open_terminal(&slave, true);

    open_stdout(slave);
    press(slave, master, 5, 5000);
    TEST_ASSERT_EQUAL_INT(0, fcntl(slave, F_GETFL) & O_NONBLOCK);
    close(slave);
    close(master);
}

static void a_usual_terminal_gets_whole_lines(void)
{
    uint64_t seed;

    doubled = true;
    for (seed = 10; seed < 30; seed++) {
        int slave;
        int master = open_terminal(&slave, false);
        open_stdout(slave);
        press(slave, master, seed, seed % 2 == 0 ? 5000 : 300);
        close(slave);
        close(master);
        sent_count = 0;
        got_count = 0;
    }
}

/* Somebody typed ^S. */
static void a_stopped_terminal_drops_records(void)
{
    int slave;
    int master = open_terminal(&slave, true);

    open_stdout(slave);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_to(slave, "one\n", 4));
    TEST_ASSERT_EQUAL_INT(0, tcflow(slave, TCOOFF));
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_to(slave, "two\n", 4));
    TEST_ASSERT_EQUAL_INT(0, tcflow(slave, TCOON));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_to(slave, "three\n", 6));
    drain_until(master, 10);
    TEST_ASSERT_EQUAL_MEMORY("one\nthree\n", got, 10);
    close(slave);
    close(master);
}

static void a_reader_that_has_gone_ends_it(void)
{
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_stdout(ends[1]);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_to(ends[1], "x\n", 2));
    close(ends[0]);
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NEVER, send_to(ends[1], "y\n", 2));
    TEST_ASSERT_EQUAL_STRING(strerror(EPIPE), error.text);
    close(ends[1]);
}

static void a_reader_that_goes_in_mid_record_ends_it(void)
{
    static char record[60000];
    int ends[2];
    int tries = 0;

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    open_stdout(ends[1]);
    while (send_to(ends[1], record, sizeof record) == HAL_SENT) {
        TEST_ASSERT_LESS_THAN_INT(100, tries++);
    }
    TEST_ASSERT_GREATER_THAN_UINT64(0, state.unsent_count);
    close(ends[0]);
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NEVER, send_to(ends[1], "y\n", 2));
    close(ends[1]);
}

static void what_cannot_be_opened_is_reported(void)
{
    int own = dup(STDOUT_FILENO);
    bool good;

    fflush(stdout);
    close(STDOUT_FILENO);
    good = hal_output_stdout(&state, &error);
    leave(own);
    TEST_ASSERT_FALSE(good);
    TEST_ASSERT_EQUAL_STRING("standard output: Bad file descriptor", error.text);
    /* Harmless afterwards. */
    hal_output_close(&state);
    TEST_ASSERT_FALSE(hal_output_udp(&state, "255.255.255.255", "5005", &error));
    TEST_ASSERT_EQUAL_STRING("255.255.255.255 port 5005: Permission denied", error.text);
    hal_output_close(&state);
}

static void a_full_disk_drops_and_may_work_again(void)
{
    int full = open("/dev/full", O_WRONLY);

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, full);
    open_stdout(full);
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_to(full, "x\n", 2));
    TEST_ASSERT_EQUAL_STRING(strerror(ENOSPC), error.text);
    TEST_ASSERT_EQUAL_UINT64(0, state.unsent_count);
    close(full);
}

static void a_file_takes_all(void)
{
    static char record[HAL_OUTPUT_RECORD_MAX + 1];
    struct ih_test_random random = {6};
    int file = open(PLAIN_FILE, O_RDWR | O_CREAT | O_TRUNC, 0600);
    int i;

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, file);
    open_stdout(file);
    for (i = 0; i < 20; i++) {
        size_t count = make_record(record, &random, i == 0 ? 9 : HAL_OUTPUT_RECORD_MAX / 2);
        TEST_ASSERT_EQUAL_INT(HAL_SENT, send_to(file, record, count));
        remember(record, count);
    }
    memset(record, 'l', sizeof record);
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_to(file, record, sizeof record));
    TEST_ASSERT_EQUAL_STRING("a record of 65508 bytes, expected at most 65507", error.text);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_to(file, record, sizeof record - 1));
    remember(record, sizeof record - 1);
    close_stdout(file);
    TEST_ASSERT_EQUAL_INT64(0, lseek(file, 0, SEEK_SET));
    TEST_ASSERT_EQUAL_UINT64(sent_count, drain(file, SENT_MAX));
    TEST_ASSERT_EQUAL_MEMORY(sent, got, sent_count);
    close(file);
}

/* A receiver on the loopback of this family; -1: this machine has none. */
static int open_receiver(const char *host, int family, char port[8])
{
    struct sockaddr_storage address;
    socklen_t length = family == AF_INET ? sizeof(struct sockaddr_in) : sizeof(struct sockaddr_in6);
    struct sockaddr_in *four = (struct sockaddr_in *)&address;
    struct sockaddr_in6 *six = (struct sockaddr_in6 *)&address;
    int receiver = socket(family, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    in_port_t wanted = htons((uint16_t)atoi(port));

    memset(&address, 0, sizeof address);
    address.ss_family = (sa_family_t)family;
    if (family == AF_INET) {
        four->sin_port = wanted;
        inet_pton(family, host, &four->sin_addr);
    } else {
        six->sin6_port = wanted;
        inet_pton(family, host, &six->sin6_addr);
    }
    if (receiver < 0 || bind(receiver, (struct sockaddr *)&address, length) != 0) {
        close(receiver);
        return -1;
    }
    TEST_ASSERT_EQUAL_INT(0, getsockname(receiver, (struct sockaddr *)&address, &length));
    snprintf(port, 8, "%d", ntohs(family == AF_INET ? four->sin_port : six->sin6_port));
    return receiver;
}

static enum hal_sent send_datagram(const char *bytes, size_t count)
{
    return state.output.send(state.output.context, bytes, count, &error);
}

static void a_datagram_is_one_record(void)
{
    static char record[HAL_OUTPUT_RECORD_MAX + 1];
    char port[8] = "0";
    int receiver = open_receiver("127.0.0.1", AF_INET, port);

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, receiver);
    TEST_ASSERT_TRUE_MESSAGE(hal_output_udp(&state, "127.0.0.1", port, &error), error.text);
    memset(record, 'r', sizeof record);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("one\n", 4));
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram(record, HAL_OUTPUT_RECORD_MAX + 1));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram(record, HAL_OUTPUT_RECORD_MAX));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("two\n", 4));
    TEST_ASSERT_EQUAL_INT64(4, recv(receiver, got, sizeof got, 0));
    TEST_ASSERT_EQUAL_MEMORY("one\n", got, 4);
    TEST_ASSERT_EQUAL_INT64(HAL_OUTPUT_RECORD_MAX, recv(receiver, got, sizeof got, 0));
    TEST_ASSERT_EQUAL_MEMORY(record, got, HAL_OUTPUT_RECORD_MAX);
    TEST_ASSERT_EQUAL_INT64(4, recv(receiver, got, sizeof got, 0));
    TEST_ASSERT_EQUAL_MEMORY("two\n", got, 4);
    hal_output_close(&state);
    close(receiver);
}

/* Nobody there: reported as far as the network reports; and when somebody comes, it goes on. */
static void a_receiver_may_go_and_come_back(void)
{
    char port[8] = "0";
    int receiver = open_receiver("127.0.0.1", AF_INET, port);
    int i;

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, receiver);
    TEST_ASSERT_TRUE(hal_output_udp(&state, "127.0.0.1", port, &error));
    close(receiver);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("lost\n", 5));
    for (i = 0; i < 10; i++) {
        TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("lost\n", 5));
        TEST_ASSERT_EQUAL_STRING(strerror(ECONNREFUSED), error.text);
    }
    receiver = open_receiver("127.0.0.1", AF_INET, port);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, receiver);
    /* said of the last one that was lost; this one arrives */
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("first\n", 6));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("second\n", 7));
    got_count = 0;
    while (drain(receiver, SENT_MAX) > 0) {
    }
    TEST_ASSERT_EQUAL_UINT64(13, got_count);
    TEST_ASSERT_EQUAL_MEMORY("first\nsecond\n", got, 13);
    hal_output_close(&state);
    close(receiver);
}

static void addresses_of_six_work_too(void)
{
    char port[8] = "0";
    int receiver = open_receiver("::1", AF_INET6, port);

    if (receiver < 0) {
        TEST_IGNORE_MESSAGE("this machine has no IPv6");
    }
    TEST_ASSERT_TRUE_MESSAGE(hal_output_udp(&state, "::1", port, &error), error.text);
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("one\n", 4));
    TEST_ASSERT_EQUAL_INT64(4, recv(receiver, got, sizeof got, 0));
    hal_output_close(&state);
    close(receiver);
}

/* A receiver that never reads fills its own buffer only. */
static void a_receiver_that_does_not_read_holds_nobody_up(void)
{
    static char record[60000];
    char port[8] = "0";
    int receiver = open_receiver("127.0.0.1", AF_INET, port);
    int i;

    TEST_ASSERT_TRUE(hal_output_udp(&state, "127.0.0.1", port, &error));
    for (i = 0; i < 200; i++) {
        TEST_ASSERT_NOT_EQUAL(HAL_SENT_NEVER, send_datagram(record, sizeof record));
    }
    hal_output_close(&state);
    close(receiver);
}

/* A terminal in place of a serial line, under a name of ours. */
static int plug_in(void)
{
    int master = terminal_open();

    remove(TTY_LINK);
    TEST_ASSERT_EQUAL_INT(0, symlink(ptsname(master), TTY_LINK));
    return master;
}

static void a_serial_line_is_raw(void)
{
    static const char bytes[] = "{\"a\":1}\n\003\004\021\023\r\177\xff\n";
    static const int32_t bauds[] = {9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
    static const speed_t speeds[] = {B9600,   B19200,  B38400,  B57600,
                                     B115200, B230400, B460800, B921600};
    int master = plug_in();
    int i;

    for (i = 0; i < IH_TEST_COUNT(bauds); i++) {
        struct termios settings;
        TEST_ASSERT_TRUE_MESSAGE(hal_output_serial(&state, TTY_LINK, bauds[i], &test_clock, &error),
                                 error.text);
        TEST_ASSERT_EQUAL_INT(0, tcgetattr(state.descriptor, &settings));
        TEST_ASSERT_EQUAL_UINT32(speeds[i], cfgetospeed(&settings));
        TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram(bytes, sizeof bytes - 1));
        drain_until(master, sizeof bytes);
        TEST_ASSERT_EQUAL_INT('\n', got[0]);
        TEST_ASSERT_EQUAL_MEMORY(bytes, got + 1, got_count - 1);
        got_count = 0;
        hal_output_close(&state);
    }
    close(master);
}

static void a_serial_line_that_is_too_slow_drops_records(void)
{
    static char record[9000];
    struct ih_test_random random = {7};
    int master = plug_in();
    bool dropped = false;
    int round = 0;

    TEST_ASSERT_TRUE(hal_output_serial(&state, TTY_LINK, 115200, &test_clock, &error));
    remember("\n", 1);
    while (!dropped || round < 200) {
        size_t count = make_record(record, &random, sizeof record);
        enum hal_sent result = send_datagram(record, count);
        TEST_ASSERT_NOT_EQUAL(HAL_SENT_NEVER, result);
        if (result == HAL_SENT) {
            remember(record, count);
        } else {
            TEST_ASSERT_EQUAL_STRING("the line is slower than the records, or stopped", error.text);
            dropped = true;
        }
        if (dropped) {
            (void)drain(master, (size_t)ih_test_between(&random, 0, 3000));
            TEST_ASSERT_EQUAL_MEMORY(sent, got, got_count);
        }
        round++;
    }
    drain_until(master, sent_count - state.unsent_count);
    TEST_ASSERT_EQUAL_MEMORY(sent, got, got_count);
    hal_output_close(&state);
    close(master);
}

/* Tried again after a second, not before; what is there then starts with an empty line. */
static void a_serial_line_that_goes_is_opened_again(void)
{
    int master = plug_in();

    TEST_ASSERT_TRUE(hal_output_serial(&state, TTY_LINK, 9600, &test_clock, &error));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("one\n", 4));
    close(master);
    now_us += 100 * 1000000;
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("two\n", 4));
    /* Nothing of that name: tried at once, as the last time is long ago, then no more. */
    remove(TTY_LINK);
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("three\n", 6));
    TEST_ASSERT_EQUAL_STRING(TTY_LINK ": No such file or directory", error.text);
    master = plug_in();
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("four\n", 5));
    TEST_ASSERT_EQUAL_STRING(TTY_LINK " is gone", error.text);
    now_us += HAL_OUTPUT_REOPEN_US - 1;
    TEST_ASSERT_EQUAL_INT(HAL_SENT_NOT, send_datagram("five\n", 5));
    now_us += 1;
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("six\n", 4));
    TEST_ASSERT_EQUAL_INT(HAL_SENT, send_datagram("seven\n", 6));
    drain_until(master, 11);
    TEST_ASSERT_EQUAL_MEMORY("\nsix\nseven\n", got, 11);
    hal_output_close(&state);
    close(master);
}

static void what_is_no_serial_line_is_reported(void)
{
    char path[HAL_OUTPUT_PATH_MAX + 1];
    int file = open(PLAIN_FILE, O_RDWR | O_CREAT, 0600);

    TEST_ASSERT_FALSE(hal_output_serial(&state, PLAIN_FILE, 9600, &test_clock, &error));
    TEST_ASSERT_EQUAL_STRING(
        PLAIN_FILE ": Inappropriate ioctl for device, expected a serial device", error.text);
    TEST_ASSERT_EQUAL_INT(-1, state.descriptor);
    TEST_ASSERT_FALSE(hal_output_serial(&state, "no/tty", 9600, &test_clock, &error));
    TEST_ASSERT_EQUAL_STRING("no/tty: No such file or directory", error.text);
    TEST_ASSERT_FALSE(hal_output_serial(&state, PLAIN_FILE, 9601, &test_clock, &error));
    TEST_ASSERT_EQUAL_STRING("9601 baud, expected 9600, 19200, ... or 921600", error.text);
    memset(path, 'p', sizeof path);
    path[HAL_OUTPUT_PATH_MAX] = 0;
    TEST_ASSERT_FALSE(hal_output_serial(&state, path, 9600, &test_clock, &error));
    TEST_ASSERT_EQUAL_STRING("a path of 256 bytes, expected at most 255", error.text);
    hal_output_close(&state);
    close(file);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_pipe_gets_whole_records);
    RUN_TEST(the_longest_records_pass_a_pipe_too);
    RUN_TEST(a_pipe_that_somebody_made_non_blocking_works_too);
    RUN_TEST(a_stream_socket_works_too);
    RUN_TEST(a_terminal_gets_whole_records);
    RUN_TEST(a_usual_terminal_gets_whole_lines);
    RUN_TEST(a_stopped_terminal_drops_records);
    RUN_TEST(a_reader_that_has_gone_ends_it);
    RUN_TEST(a_reader_that_goes_in_mid_record_ends_it);
    RUN_TEST(what_cannot_be_opened_is_reported);
    RUN_TEST(a_full_disk_drops_and_may_work_again);
    RUN_TEST(a_file_takes_all);
    RUN_TEST(a_datagram_is_one_record);
    RUN_TEST(a_receiver_may_go_and_come_back);
    RUN_TEST(addresses_of_six_work_too);
    RUN_TEST(a_receiver_that_does_not_read_holds_nobody_up);
    RUN_TEST(a_serial_line_is_raw);
    RUN_TEST(a_serial_line_that_is_too_slow_drops_records);
    RUN_TEST(a_serial_line_that_goes_is_opened_again);
    RUN_TEST(what_is_no_serial_line_is_reported);
    return UNITY_END();
}
