/* A frames directory whose list of files ends with an error, or that cannot be looked into: nothing of it is left out in
 * silence. readdir and lstat are wrapped by the linker. */
#include "replay/hal_replay.h"
#include "sim_dirs.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "unity.h"

#define FRAMES 3
/* Their names, "." and "..", rig.json, and the end. */
#define CALLS (FRAMES + 4)

static char root[] = "/tmp/isohead_replay_XXXXXX";
static char dir[64];
static int calls, failing; /* which call fails, from 1; 0: none */
static int reported;
static int lstat_error; /* what lstat fails with in the frames directory; 0: it does not */

struct dirent *__real_readdir(DIR *stream);
struct dirent *__wrap_readdir(DIR *stream);

struct dirent *__wrap_readdir(DIR *stream)
{
    if (++calls == failing) {
        errno = EIO;
        return NULL;
    }
    return __real_readdir(stream);
}

int __real_lstat(const char *path, struct stat *status);
int __wrap_lstat(const char *path, struct stat *status);

int __wrap_lstat(const char *path, struct stat *status)
{
    if (lstat_error != 0 && strncmp(path, dir, strlen(dir)) == 0) {
        errno = lstat_error;
        return -1;
    }
    return __real_lstat(path, status);
}

static void make_file(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    FILE *file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs("P5 1 1 255 x", file);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void remove_file(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
}

void setUp(void)
{
    calls = failing = reported = lstat_error = 0;
}

void tearDown(void)
{
}

static void count_message(void *context, const char *subject, const char *text)
{
    (void)context, (void)subject, (void)text;
    reported++;
}

static void test_a_list_that_ends_with_an_error_opens_nothing(void)
{
    const struct hal_log log = {.error = count_message};
    struct hal_replay replay;
    struct hal_error error = {""};
    for (failing = 1; failing <= CALLS; failing++) {
        calls = 0;
        TEST_ASSERT_FALSE(hal_replay_open(&replay, dir, false, &log, &error));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, strerror(EIO)), error.text);
    }
    calls = 0; /* beyond the end */
    TEST_ASSERT_TRUE(hal_replay_open(&replay, dir, false, &log, &error));
    TEST_ASSERT_EQUAL_INT(CALLS, calls);
    TEST_ASSERT_EQUAL_INT(FRAMES, replay.entry_count);
    TEST_ASSERT_EQUAL_INT(0, reported);
    hal_replay_close(&replay);
}

/* Whatever call fails for the directory above: an error, or all of its frames directories. */
static void test_no_directory_is_left_out(void)
{
    const int all = 40;
    int errors = 0;
    for (failing = 1; failing <= all; failing++) {
        for (int with_rig = 0; with_rig < 2; with_rig++) {
            struct sim_dirs dirs = {.dir_count = 0};
            struct sim_report report;
            calls = 0;
            sim_report_init(&report);
            sim_dirs_add(&dirs, root, with_rig != 0, &report);
            TEST_ASSERT_TRUE(report.error_count > 0 || dirs.dir_count == 1);
            errors += report.error_count > 0;
            sim_dirs_free(&dirs);
        }
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(6, errors); /* ".", "..", the directory, the end, of both */
}

/* Only one without a rig is passed over, not one that does not let its rig be seen: opening that says why. */
static void test_a_directory_that_cannot_be_looked_into_is_not_passed_over(void)
{
    static const struct {
        int error;
        int dir_count;
    } of[] = {{ENOENT, 0}, {ENOTDIR, 0}, {EACCES, 1}, {EIO, 1}, {ELOOP, 1}, {ENAMETOOLONG, 1}};
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        struct sim_dirs dirs = {.dir_count = 0};
        struct sim_report report;
        sim_report_init(&report);
        lstat_error = of[i].error;
        sim_dirs_add(&dirs, root, false, &report);
        TEST_ASSERT_EQUAL_INT(of[i].dir_count, dirs.dir_count);
        TEST_ASSERT_EQUAL_INT(of[i].dir_count == 0, report.error_count > 0);
        sim_dirs_free(&dirs);
    }
}

int main(void)
{
    TEST_ASSERT_NOT_NULL(mkdtemp(root));
    snprintf(dir, sizeof dir, "%s/frames", root);
    TEST_ASSERT_EQUAL_INT(0, mkdir(dir, 0700));
    static const char *const names[] = {"a.pgm", "b.pgm", "c.pgm", "rig.json"};
    for (int i = 0; i < FRAMES + 1; i++) {
        make_file(names[i]);
    }
    UNITY_BEGIN();
    RUN_TEST(test_a_list_that_ends_with_an_error_opens_nothing);
    RUN_TEST(test_no_directory_is_left_out);
    RUN_TEST(test_a_directory_that_cannot_be_looked_into_is_not_passed_over);
    int failures = UNITY_END();
    for (int i = 0; i < FRAMES + 1; i++) {
        remove_file(names[i]);
    }
    rmdir(dir);
    rmdir(root);
    return failures;
}
