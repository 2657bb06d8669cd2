/* The strobe against fakes of libgpiod 1 and, built once more, 2: what is on the wire, and what is
 * left when any call fails. */
#include <dirent.h>
#include <poll.h>
#include <unistd.h>

#include "fake_gpio.h"
#include "ih_test.h"
#include "linux/hal_gpio.h"

static const struct hal_gpio_config plain = {
    .chip = "pl061", .laser_line = "laser", .consumer = "isohead"};
static const struct hal_gpio_config full = {.chip = "gpiochip0",
                                            .laser_line = "laser",
                                            .interlock_line = "interlock",
                                            .heartbeat_line = "beat",
                                            .consumer = "isohead"};

static struct hal_gpio gpio;
static struct hal_error error;
static struct fake_line *const lines = fake.chip[0].line;
static struct fake_line *const laser = &fake.chip[0].line[6];
static struct fake_line *const interlock = &fake.chip[0].line[7];
static struct fake_line *const beat = &fake.chip[0].line[1];

static int open_fd_count(void)
{
    DIR *list = opendir("/proc/self/fd");
    int count = 0;

    while (readdir(list) != NULL) {
        count++;
    }
    closedir(list);
    return count;
}

static bool open_with(const struct hal_gpio_config *config)
{
    hal_gpio_init(&gpio, config);
    return gpio.strobe.open(gpio.strobe.context, &error);
}

static bool set(bool on)
{
    return gpio.strobe.set(gpio.strobe.context, on, &error);
}

static void close_it(void)
{
    gpio.strobe.close(gpio.strobe.context);
}

static void nothing_is_left(int64_t index)
{
    int i, k;

    for (i = 0; i < FAKE_CHIPS; i++) {
        IH_TEST_EQUAL(0, fake.chip[i].open_count, "open chips", index);
        for (k = 0; k < FAKE_LINES; k++) {
            IH_TEST_EQUAL(false, fake.chip[i].line[k].taken, "taken line", index);
        }
    }
    IH_TEST_EQUAL(0, fake.object_count, "objects of libgpiod", index);
    IH_TEST_EQUAL(0, fake.misuse_count, "misuses", index);
    IH_TEST_EQUAL(-1, gpio.laser_fd, "laser_fd", index);
    IH_TEST_EQUAL(-1, gpio.interlock_fd, "interlock_fd", index);
}

void setUp(void)
{
    fake_reset();
    memset(&error, 0, sizeof error);
}

void tearDown(void)
{
    close_it();
    nothing_is_left(0);
}

static void the_laser_is_off_from_the_first_moment(void)
{
    TEST_ASSERT_TRUE_MESSAGE(open_with(&plain), error.text);
    TEST_ASSERT_EQUAL_STRING("0", laser->trace);
    TEST_ASSERT_TRUE(laser->taken && laser->output);
    TEST_ASSERT_EQUAL_STRING("isohead", laser->consumer);
}

static void an_active_low_laser_is_off_when_high(void)
{
    struct hal_gpio_config config = plain;

    config.laser_active_low = true;
    laser->level = 0;
    TEST_ASSERT_TRUE_MESSAGE(open_with(&config), error.text);
    TEST_ASSERT_EQUAL_STRING("1", laser->trace);
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_EQUAL_STRING("101", laser->trace);
    TEST_ASSERT_TRUE(set(true));
    close_it();
    TEST_ASSERT_EQUAL_STRING("10101", laser->trace);
}

static void on_is_high_and_closing_switches_off_first(void)
{
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_EQUAL_INT(1, laser->level);
    close_it();
    TEST_ASSERT_EQUAL_STRING("010", laser->trace);
    TEST_ASSERT_FALSE(laser->taken);
    close_it();
    TEST_ASSERT_EQUAL_STRING("010", laser->trace);
}

static void opened_again_the_lines_are_taken_anew(void)
{
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE_MESSAGE(gpio.strobe.open(gpio.strobe.context, &error), error.text);
    TEST_ASSERT_EQUAL_STRING("0100", laser->trace);
    TEST_ASSERT_TRUE(laser->taken && interlock->taken && beat->taken);
}

static void the_descriptors_are_those_of_the_lines(void)
{
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_EQUAL_INT(laser->fd, gpio.laser_fd);
    TEST_ASSERT_EQUAL_INT(interlock->fd, gpio.interlock_fd);
    close_it();
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_EQUAL_INT(-1, gpio.interlock_fd);
}

/* What libgpiod 1 does not tell is found out: never another file's, whatever else a request opens. */
static void no_other_descriptor_is_taken_for_the_lines(void)
{
    fake.opens_more = true;
    fake.more_fd = -1;
    bool good = open_with(&plain);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fake.more_fd);
    TEST_ASSERT_EQUAL_INT(good ? laser->fd : -1, gpio.laser_fd);
    TEST_ASSERT_EQUAL(good, laser->taken);
    close(fake.more_fd);
}

static void not_taken_off_is_nothing_and_the_rest_fails(void)
{
    bool closed = true;

    hal_gpio_init(&gpio, &full);
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_FALSE(gpio.strobe.beat(gpio.strobe.context, &error));
    TEST_ASSERT_FALSE(gpio.strobe.interlock(gpio.strobe.context, &closed, &error));
    TEST_ASSERT_FALSE(closed);
    TEST_ASSERT_EQUAL_INT(0, fake.calls);
}

static void the_heartbeat_toggles_from_low(void)
{
    int i;

    TEST_ASSERT_TRUE(open_with(&full));
    for (i = 0; i < 4; i++) {
        TEST_ASSERT_TRUE(gpio.strobe.beat(gpio.strobe.context, &error));
    }
    TEST_ASSERT_EQUAL_STRING("01010", beat->trace);
    TEST_ASSERT_EQUAL_STRING("0", laser->trace);
    close_it();
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(gpio.strobe.beat(gpio.strobe.context, &error));
    TEST_ASSERT_EQUAL_STRING("01010", beat->trace);
}

static void chips_and_lines_have_several_names(void)
{
    static const char *const chips[] = {"/dev/gpiochip0", "gpiochip0", "pl061"};
    static const char *const names[] = {"laser", "6", "006"};
    int i, k;

    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3; k++) {
            struct hal_gpio_config config = plain;

            config.chip = chips[i];
            config.laser_line = names[k];
            fake_reset();
            TEST_ASSERT_TRUE_MESSAGE(open_with(&config), error.text);
            TEST_ASSERT_TRUE(laser->taken);
            close_it();
        }
    }
}

/* Opening fails, and the error has all these words. */
static void refused(const struct hal_gpio_config *config, const char *const *words)
{
    TEST_ASSERT_FALSE(open_with(config));
    for (; *words != NULL; words++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, *words), error.text);
    }
    TEST_ASSERT_EQUAL_STRING("", laser->trace);
    nothing_is_left(0);
}

#define REFUSED(field, value, ...)                                   \
    do {                                                             \
        struct hal_gpio_config config_ = full;                       \
        config_.field = (value);                                     \
        refused(&config_, (const char *const[]){__VA_ARGS__, NULL}); \
    } while (0)

static void unknown_names_are_answered_with_what_there_is(void)
{
    REFUSED(chip, "pl06", "gpio-chip", "'pl06'", "gpiochip0 (pl061)", "gpiochip1 (soc)");
    REFUSED(chip, "soc", "gpio-chip", "2 chips", "'soc'", "gpiochip1 (soc) gpiochip2 (soc)");
    REFUSED(chip, "/dev/gpiochip9", "gpio-chip", "/dev/gpiochip9", "No such file");
    REFUSED(chip, "", "gpio-chip", "''");
    REFUSED(laser_line, "lasr", "laser-line", "gpiochip0 (pl061)", "'lasr'", " 0 'beat' 'fan'",
            "'laser' 'interlock'");
    REFUSED(laser_line, "8", "laser-line", "gpiochip0 (pl061)", "line 8", "0..7");
    REFUSED(laser_line, "4294967302", "laser-line", "4294967302", "0..7");
    REFUSED(laser_line, "-1", "laser-line", "'-1'");
    REFUSED(laser_line, "", "laser-line", "''");
    REFUSED(laser_line, "twin", "laser-line", "2 lines", "gpiochip0 (pl061)", "'twin'", "0..7");
    REFUSED(interlock_line, "x", "interlock-line", "'x'");
    REFUSED(heartbeat_line, "x", "heartbeat-line", "'x'");
    fake.chip_count = 0;
    REFUSED(chip, "pl061", "gpio-chip", "'pl061'", "none", "/dev/gpiochip*");
}

static void one_line_is_not_used_twice(void)
{
    REFUSED(interlock_line, "6", "laser-line", "interlock-line", "line 6", "gpiochip0 (pl061)");
    REFUSED(heartbeat_line, "laser", "laser-line", "heartbeat-line", "line 6");
    REFUSED(heartbeat_line, "interlock", "heartbeat-line", "interlock-line", "line 7");
}

static void a_line_in_use_is_reported_with_its_user(void)
{
    REFUSED(laser_line, "fan", "laser-line", "line 2", "'fan'", "gpiochip0 (pl061)", "busy",
            "used by fan driver");
    REFUSED(laser_line, "3", "laser-line", "line 3", "busy", "used by the kernel");
}

static bool open_without_line(const char *chip, const char *line)
{
    struct hal_gpio_config config = plain;

    config.chip = chip;
    config.laser_line = line;
    TEST_ASSERT_FALSE(open_with(&config));
    return gpio.has_no_line;
}

/* A line that ours hold is there. */
static void a_line_that_is_not_there_or_is_others_is_known(void)
{
    TEST_ASSERT_TRUE(open_without_line("none", "laser"));
    TEST_ASSERT_TRUE(open_without_line("/dev/gpiochip9", "laser"));
    TEST_ASSERT_TRUE(open_without_line("pl061", "lasr"));
    TEST_ASSERT_TRUE(open_without_line("pl061", "8"));
    TEST_ASSERT_TRUE(open_without_line("pl061", "fan"));
    lines[2].user = "isohead";
    TEST_ASSERT_FALSE(open_without_line("pl061", "fan"));
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_FALSE(gpio.has_no_line);
    close_it();
    laser->is_stuck = true;
    laser->level = 1;
    TEST_ASSERT_FALSE(open_without_line("pl061", "laser"));
}

static void long_names_are_cut_visibly(void)
{
    char name[400];

    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = 0;
    REFUSED(chip, name, "gpio-chip", "xxx", "gpiochip2 (soc)");
    REFUSED(laser_line, name, "laser-line", "xxx", "gpiochip0");
    lines[0].name = lines[1].name = lines[2].name = lines[3].name = lines[4].name = lines[5].name =
        "a name as long as names may be";
    REFUSED(laser_line, "x", "laser-line", "'x'", "...");
    TEST_ASSERT_EQUAL_INT(HAL_ERROR_MAX - 1, strlen(error.text));
}

static bool is_closed(void)
{
    bool closed = false;

    TEST_ASSERT_TRUE_MESSAGE(gpio.strobe.interlock(gpio.strobe.context, &closed, &error),
                             error.text);
    return closed;
}

static bool has_news(void)
{
    struct pollfd waiting = {.fd = gpio.interlock_fd, .events = POLLIN};

    return poll(&waiting, 1, 0) == 1;
}

static void the_interlock_is_its_level(void)
{
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_FALSE(is_closed());
    fake_drive(interlock, 1);
    TEST_ASSERT_TRUE(has_news());
    TEST_ASSERT_FALSE(is_closed());
    TEST_ASSERT_FALSE(has_news());
    TEST_ASSERT_TRUE(is_closed());
    fake_drive(interlock, 0);
    TEST_ASSERT_FALSE(is_closed());
    TEST_ASSERT_FALSE(is_closed());
}

static void without_an_interlock_it_is_closed(void)
{
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(is_closed());
}

static void an_active_low_interlock_is_closed_when_low(void)
{
    struct hal_gpio_config config = full;

    config.interlock_active_low = true;
    TEST_ASSERT_TRUE(open_with(&config));
    TEST_ASSERT_TRUE(is_closed());
    fake_drive(interlock, 1);
    TEST_ASSERT_FALSE(is_closed());
    fake_drive(interlock, 0);
    TEST_ASSERT_FALSE(is_closed());
    TEST_ASSERT_TRUE(is_closed());
}

/* It opens again between any two looks, and is closed whenever it is looked at. */
static void a_contact_that_chatters_is_never_closed(void)
{
    int look;

    interlock->level = 1;
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_TRUE(is_closed());
    for (look = 0; look < 10; look++) {
        fake_drive(interlock, 0);
        fake_drive(interlock, 1);
        TEST_ASSERT_FALSE(is_closed());
    }
    TEST_ASSERT_TRUE(is_closed());
}

static void a_short_opening_is_reported_once(void)
{
    int pulses;

    interlock->level = 1;
    TEST_ASSERT_TRUE(open_with(&full));
    for (pulses = 1; pulses <= 8; pulses++) {
        int i;

        TEST_ASSERT_TRUE(is_closed());
        for (i = 0; i < pulses; i++) {
            fake_drive(interlock, 0);
            fake_drive(interlock, 1);
        }
        TEST_ASSERT_FALSE(is_closed());
    }
    TEST_ASSERT_TRUE(is_closed());
}

/* The kernel keeps more events than one call takes: they are not lost, only reported later. */
static void many_events_are_taken_by_several_calls(void)
{
    int i;

    interlock->level = 1;
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_TRUE(is_closed());
    for (i = 0; i < 20; i++) {
        fake_drive(interlock, i % 2);
    }
    TEST_ASSERT_FALSE(is_closed());
    TEST_ASSERT_TRUE(has_news());
    TEST_ASSERT_FALSE(is_closed());
    TEST_ASSERT_FALSE(has_news());
    TEST_ASSERT_TRUE(is_closed());
}

static void an_interlock_that_cannot_be_read_is_not_closed(void)
{
    int call;

    for (call = 1; call <= 3; call++) {
        bool closed = true;

        fake_reset();
        interlock->level = 1;
        TEST_ASSERT_TRUE(open_with(&full));
        TEST_ASSERT_TRUE(is_closed());
        fake_drive(interlock, 0);
        fake_drive(interlock, 1);
        fake.fail_at = fake.calls + call; /* wait, read, level */
        TEST_ASSERT_FALSE(gpio.strobe.interlock(gpio.strobe.context, &closed, &error));
        TEST_ASSERT_FALSE(closed);
        TEST_ASSERT_NOT_NULL(strstr(error.text, "interlock"));
        TEST_ASSERT_NOT_NULL(strstr(error.text, "gpiochip0"));
        close_it();
    }
}

static void off_is_tried_again(void)
{
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(set(true));
    fake.fail_at = fake.calls + 1;
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_EQUAL_INT(0, laser->level);
}

static void a_line_that_stays_on_is_reported_and_given_back(void)
{
    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(set(true));
    fake.fail_at = fake.calls + 1;
    fake.fail_for_good = true;
    fake.fail_errno = 19;
    TEST_ASSERT_FALSE(set(false));
    TEST_ASSERT_EQUAL_STRING("laser-line: 'laser' of gpiochip0: cannot be switched off: error 19",
                             error.text);
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "'laser' of gpiochip0: cannot be switched on: "));
    close_it();
    TEST_ASSERT_FALSE(laser->taken);
}

/* Something else drives the wire, or the transistor of the output has failed. */
static void a_line_that_reads_on_after_off_is_reported(void)
{
    bool on = false;

    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(gpio.strobe.level(gpio.strobe.context, &on, &error));
    TEST_ASSERT_TRUE(on);
    laser->is_stuck = true;
    TEST_ASSERT_FALSE(set(false));
    TEST_ASSERT_EQUAL_STRING("laser-line: 'laser' of gpiochip0: switched off, and reads as on",
                             error.text);
    TEST_ASSERT_EQUAL_STRING("01000", laser->trace); /* HAL_GPIO_OFF_TRIES times */
    laser->is_stuck = false;
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_TRUE(gpio.strobe.level(gpio.strobe.context, &on, &error));
    TEST_ASSERT_FALSE(on);
    close_it();
    laser->level = 1;
    laser->is_stuck = true;
    TEST_ASSERT_FALSE(open_with(&plain));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "taken as off, and reads as on"), error.text);
    TEST_ASSERT_FALSE(laser->taken);
}

/* Never on: a chip that reads 0 whatever it drives. Off after it was on: something is broken. */
static void a_line_that_reads_off_after_on_is_reported_once_it_was_on(void)
{
    TEST_ASSERT_TRUE(open_with(&plain));
    laser->is_stuck = true;
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(set(false));
    laser->is_stuck = false;
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(set(false));
    laser->is_stuck = true;
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "cannot be switched on: it reads as off"),
                                 error.text);
}

static bool prove(struct hal_error *unproven)
{
    return gpio.strobe.prove(gpio.strobe.context, unproven, &error);
}

/* What the start can show, and what it says of the rest. */
static void what_can_be_tried_at_the_start_is_tried(void)
{
    struct hal_error unproven;

    TEST_ASSERT_TRUE(open_with(&plain));
    TEST_ASSERT_TRUE(prove(&unproven));
    TEST_ASSERT_EQUAL_STRING("", unproven.text);
    close_it();
    interlock->level = 1;
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_TRUE_MESSAGE(prove(&unproven), error.text);
    TEST_ASSERT_EQUAL_STRING("heartbeat-line: moves, but not that its one-shot acts; "
                             "interlock-line: closed since the start, not that it opens",
                             unproven.text);
    TEST_ASSERT_EQUAL_STRING("010", beat->trace);
    TEST_ASSERT_EQUAL_STRING("000", laser->trace); /* taken, given back, taken */
    beat->is_stuck = true;
    TEST_ASSERT_FALSE(prove(&unproven));
    TEST_ASSERT_EQUAL_STRING("heartbeat-line: 'beat' of gpiochip0 was set to 1 and reads 0",
                             error.text);
    close_it();
    fake_reset();
    fake.unreadable = true; /* open now, too */
    TEST_ASSERT_TRUE(open_with(&full));
    TEST_ASSERT_TRUE(prove(&unproven));
    TEST_ASSERT_EQUAL_STRING("laser-line: cannot be read back; heartbeat-line: cannot be read back",
                             unproven.text);
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(set(false));
}

/* As a program does: on the first failure it closes, at the end too. */
static bool use(const struct hal_gpio_config *config)
{
    const struct hal_strobe *strobe = &gpio.strobe;
    void *context = strobe->context;
    bool closed = false;
    struct hal_error unproven;
    bool good = open_with(config) && strobe->prove(context, &unproven, &error) &&
                strobe->interlock(context, &closed, &error) && strobe->set(context, true, &error) &&
                strobe->beat(context, &error);

    if (good) {
        fake_drive(interlock, 0);
        good = strobe->interlock(context, &closed, &error) && !closed &&
               strobe->set(context, false, &error) && strobe->set(context, true, &error) &&
               strobe->open(context, &error) && strobe->set(context, true, &error);
    }
    strobe->close(context);
    return good;
}

static void any_call_may_fail_once(bool for_good, bool active_low)
{
    struct hal_gpio_config config = full;
    const int fd_count = open_fd_count();
    int call, last = 1;

    config.laser_active_low = active_low;
    config.chip = "pl061";
    for (call = 0; call <= last; call++) {
        bool good;

        fake_reset();
        interlock->level = 1;
        laser->level = active_low; /* off, by the board's pull */
        fake.fail_at = call;
        fake.fail_for_good = for_good;
        memset(&error, 0, sizeof error);
        good = use(&config);
        IH_TEST_EQUAL(good, error.text[0] == 0, "message", call);
        if (call == 0) {
            last = fake.calls;
            TEST_ASSERT_TRUE_MESSAGE(good, error.text);
        }
        if (!for_good) {
            IH_TEST_EQUAL(active_low, laser->level, "laser off", call);
        }
        nothing_is_left(call);
        IH_TEST_EQUAL(fd_count, open_fd_count(), "open descriptors", call);
    }
    printf("%d calls, each failed %s: nothing left%s\n", last, for_good ? "for good" : "once",
           for_good ? "" : ", laser off after each");
}

static void after_any_single_fault_the_laser_is_off_and_nothing_is_left(void)
{
    any_call_may_fail_once(false, false);
    any_call_may_fail_once(false, true);
}

static void when_the_chip_fails_for_good_nothing_is_left(void)
{
    any_call_may_fail_once(true, false);
}

/* Opening that failed has left nothing behind even before it is closed. */
static void a_failed_opening_takes_nothing(void)
{
    int call, last = 1;

    for (call = 0; call <= last; call++) {
        bool good;

        fake_reset();
        fake.fail_at = call;
        good = open_with(&full);
        if (call == 0) {
            TEST_ASSERT_TRUE(good);
            last = fake.calls;
            close_it();
        } else if (!good) {
            TEST_ASSERT_TRUE(strlen(error.text) > 20);
            IH_TEST_EQUAL(true, laser->trace[0] == 0 || laser->level == 0, "laser off", call);
            nothing_is_left(call);
        } else {
            close_it();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    hal_gpio_init(&gpio, &plain);
    RUN_TEST(the_laser_is_off_from_the_first_moment);
    RUN_TEST(an_active_low_laser_is_off_when_high);
    RUN_TEST(on_is_high_and_closing_switches_off_first);
    RUN_TEST(opened_again_the_lines_are_taken_anew);
    RUN_TEST(the_descriptors_are_those_of_the_lines);
    RUN_TEST(no_other_descriptor_is_taken_for_the_lines);
    RUN_TEST(not_taken_off_is_nothing_and_the_rest_fails);
    RUN_TEST(the_heartbeat_toggles_from_low);
    RUN_TEST(chips_and_lines_have_several_names);
    RUN_TEST(unknown_names_are_answered_with_what_there_is);
    RUN_TEST(one_line_is_not_used_twice);
    RUN_TEST(a_line_in_use_is_reported_with_its_user);
    RUN_TEST(a_line_that_is_not_there_or_is_others_is_known);
    RUN_TEST(long_names_are_cut_visibly);
    RUN_TEST(the_interlock_is_its_level);
    RUN_TEST(without_an_interlock_it_is_closed);
    RUN_TEST(an_active_low_interlock_is_closed_when_low);
    RUN_TEST(a_contact_that_chatters_is_never_closed);
    RUN_TEST(a_short_opening_is_reported_once);
    RUN_TEST(many_events_are_taken_by_several_calls);
    RUN_TEST(an_interlock_that_cannot_be_read_is_not_closed);
    RUN_TEST(off_is_tried_again);
    RUN_TEST(a_line_that_stays_on_is_reported_and_given_back);
    RUN_TEST(a_line_that_reads_on_after_off_is_reported);
    RUN_TEST(a_line_that_reads_off_after_on_is_reported_once_it_was_on);
    RUN_TEST(what_can_be_tried_at_the_start_is_tried);
    RUN_TEST(after_any_single_fault_the_laser_is_off_and_nothing_is_left);
    RUN_TEST(when_the_chip_fails_for_good_nothing_is_left);
    RUN_TEST(a_failed_opening_takes_nothing);
    return UNITY_END();
}
