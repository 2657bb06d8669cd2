/* An accelerometer: files in place of sysfs, and a pause in which they change. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "ih_test.h"
#include "linux/hal_iio.h"

#define LEVEL "0", "-981", "0"

static char root[64];
static struct hal_iio_up up;
static struct hal_error error;
static int pause_count;
/* The value of in_accel_x_raw in each pause by turns; 0, 0: it stays. */
static int shake_raw[2];

static void put(const char *device, const char *file, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", root, device);
    mkdir(path, 0700);
    snprintf(path, sizeof path, "%s/%s/%s", root, device, file);
    remove(path);
    if (text == NULL) {
        return;
    }
    FILE *stream = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(stream);
    fprintf(stream, "%s\n", text);
    fclose(stream);
}

int nanosleep(const struct timespec *wanted, struct timespec *remaining)
{
    char text[16];
    (void)remaining;
    TEST_ASSERT_EQUAL_INT64(1000 * 7, wanted->tv_nsec);
    if (shake_raw[0] != shake_raw[1]) {
        snprintf(text, sizeof text, "%d", shake_raw[pause_count % 2]);
        put("iio:device0", "in_accel_x_raw", text);
    }
    pause_count++;
    return 0;
}

static void put_raw(const char *device, const char *x, const char *y, const char *z)
{
    put(device, "in_accel_x_raw", x);
    put(device, "in_accel_y_raw", y);
    put(device, "in_accel_z_raw", z);
}

static void clear(void)
{
    char command[256];
    snprintf(command, sizeof command, "rm -rf %s/iio* %s/other", root, root);
    TEST_ASSERT_EQUAL_INT(0, system(command));
}

/* A level camera's, without a matrix. */
void setUp(void)
{
    shake_raw[0] = shake_raw[1] = 0;
    pause_count = 0;
    put("iio:device0", "name", "bmi160");
    put("iio:device0", "in_accel_scale", "0.01");
    put_raw("iio:device0", LEVEL);
    memset(&up, 0, sizeof up);
    error.text[0] = 0;
}

void tearDown(void)
{
    clear();
}

static bool read_up(const char *called)
{
    const struct hal_iio_config config = {.called = called, .dir = root, .pause_us = 7};
    return hal_iio_read(&config, &up, &error);
}

static void expect_up(double x, double y, double z)
{
    const double expected[3] = {x, y, z};
    TEST_ASSERT_TRUE_MESSAGE(read_up("bmi160"), error.text);
    for (int axis = 0; axis < 3; axis++) {
        TEST_ASSERT_TRUE_MESSAGE(fabs(up.up[axis] - expected[axis]) < 1e-6, "up");
    }
}

static void expect_error(const char *called, const char *text)
{
    TEST_ASSERT_FALSE(read_up(called));
    TEST_ASSERT_TRUE_MESSAGE(strstr(error.text, text) != NULL, error.text);
}

static void test_names(void)
{
    char path[128];
    put("iio:device1", "name", "ad7124");
    put("iio:device10", "name", "lis3dh");
    put("iio:device10", "in_accel_scale", "0.02");
    put_raw("iio:device10", "490.5", "0", "0");
    put("other", "name", "bmi160");
    expect_up(0.0, -1.0, 0.0);
    TEST_ASSERT_EQUAL_STRING("bmi160 (iio:device0)", up.device);
    TEST_ASSERT_TRUE_MESSAGE(fabs(up.gravity_m_s2 - 9.81) < 1e-9, "m/s2");
    TEST_ASSERT_EQUAL_INT(HAL_IIO_SAMPLES, pause_count);
    TEST_ASSERT_TRUE_MESSAGE(read_up("iio:device0"), error.text);
    TEST_ASSERT_TRUE_MESSAGE(read_up("iio:device10") && up.up[0] > 0.999, error.text);
    TEST_ASSERT_EQUAL_STRING("lis3dh (iio:device10)", up.device);
    snprintf(path, sizeof path, "%s/iio:device10", root);
    put("iio:device10", "name", NULL);
    TEST_ASSERT_TRUE_MESSAGE(read_up(path) && up.up[0] > 0.999, error.text);
    TEST_ASSERT_EQUAL_STRING("accelerometer (iio:device10)", up.device);
}

static void test_scale_and_offset(void)
{
    put("iio:device0", "in_accel_scale", NULL);
    put("iio:device0", "in_accel_x_scale", "0.01");
    put("iio:device0", "in_accel_y_scale", "0.02");
    put("iio:device0", "in_accel_z_scale", "0.04");
    put("iio:device0", "in_accel_offset", "-100");
    put("iio:device0", "in_accel_z_offset", "25");
    put_raw("iio:device0", "100", "-194.3", "171.2");
    expect_up(0.0, -0.6, 0.8);
}

/* The sensor lies flat: its z is the camera's -y where the board stands behind a camera, its x the camera's z. */
static void test_mount_matrix(void)
{
    put_raw("iio:device0", "0", "0", "981");
    put("iio:device0", "in_mount_matrix", "0, 1, 0; 0, 0, -1; -1, 0, 0");
    expect_up(0.0, -1.0, 0.0);
    put_raw("iio:device0", "-490.5", "0", "849.571");
    expect_up(0.0, -0.8660254, 0.5);
    put("iio:device0", "in_accel_mount_matrix",
        "1,0,0;0,1,0;0,0,1"); /* goes before the common one */
    expect_up(-0.5, 0.0, 0.8660254);
    put("iio:device0", "in_accel_mount_matrix", NULL);
    put("iio:device0", "in_mount_matrix", NULL);
    put("iio:device0", "mount_matrix", "0, -1, 0; 1, 0, 0; 0, 0, 1");
    expect_up(0.0, -0.5, 0.8660254);
}

static void test_matrices_that_are_none(void)
{
    static const char *const texts[] = {
        "",
        "1, 0, 0; 0, 1, 0; 0, 0",
        "1, 0, 0, 0, 1, 0, 0, 0, 1",
        "1, 0, 0; 0, 1, 0; 0, 0, 1; 0",
        "1, 0, 0; 0, 1, 0; 0, 0, x",
        "1, 0, 0; 0, 1, 0; 0, 0, nan",
        "1, 0, 0; 0, 1, 0; 0, 0, -1", /* a mirror */
        "2, 0, 0; 0, 2, 0; 0, 0, 2",
        "1, 0, 0; 1, 0, 0; 0, 0, 1",
        "0, 0, 0; 0, 0, 0; 0, 0, 0",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        put("iio:device0", "in_mount_matrix", texts[i]);
        expect_error("bmi160", "expected a rotation, such as 1, 0, 0; 0, 1, 0; 0, 0, 1");
    }
}

static void test_no_such_device(void)
{
    expect_error("bmi270", "no such device in /tmp/isohead_iio_");
    expect_error("iio:device1", ", there are: bmi160 (iio:device0)");
    put("iio:device3", "name", "bmi160");
    expect_error("bmi160", "2 devices have this name, expected iio:deviceN of one: bmi160 "
                           "(iio:device0); bmi160 (iio:device3)");
    clear();
    expect_error("bmi160", "there is none");
    expect_error("/nowhere/iio:device0", "/nowhere/iio:device0/in_accel_scale: No such file");
    const struct hal_iio_config nowhere = {.called = "bmi160", .dir = "/nowhere", .pause_us = 7};
    TEST_ASSERT_FALSE(hal_iio_read(&nowhere, &up, &error));
    TEST_ASSERT_EQUAL_STRING("/nowhere: No such file or directory", error.text);
}

static void test_unreadable(void)
{
    put("iio:device0", "in_accel_y_raw", NULL);
    expect_error("bmi160", "iio:device0/in_accel_y_raw: No such file or directory");
    put("iio:device0", "in_accel_y_raw", "high");
    expect_error("bmi160", "iio:device0/in_accel_y_raw: \"high\", expected a number");
    put("iio:device0", "in_accel_y_raw", "");
    expect_error("bmi160", "iio:device0/in_accel_y_raw: \"\", expected a number");
    put("iio:device0", "in_accel_y_raw", "5 6");
    expect_error("bmi160", "\"5 6\", expected a number");
    put("iio:device0", "in_accel_y_raw", "inf");
    expect_error("bmi160", "\"inf\", expected a number");
    put_raw("iio:device0", LEVEL);
    put("iio:device0", "in_accel_scale", "nan");
    expect_error("bmi160", "iio:device0/in_accel_scale: \"nan\", expected a number");
    put("iio:device0", "in_accel_scale", NULL);
    put("iio:device0/in_accel_scale", "file", "1");
    expect_error("bmi160", "iio:device0/in_accel_scale: a directory, expected a file");
    if (geteuid() != 0) {
        char path[128];
        clear();
        setUp();
        snprintf(path, sizeof path, "%s/iio:device0/in_accel_z_raw", root);
        TEST_ASSERT_EQUAL_INT(0, chmod(path, 0));
        expect_error("bmi160", "iio:device0/in_accel_z_raw: Permission denied");
    }
}

static void test_not_gravity(void)
{
    put_raw("iio:device0", "0", "0", "0");
    expect_error("bmi160", "it reads 0.00 m/s2, expected 7.8 to 11.8 of a camera at rest");
    put_raw("iio:device0", "0", "784", "0");
    expect_error("bmi160", "it reads 7.84 m/s2");
    put_raw("iio:device0", "0", "1177", "0");
    expect_error("bmi160", "it reads 11.77 m/s2");
    put_raw("iio:device0", "0", "1176", "0");
    expect_up(0.0, 1.0, 0.0);
    put("iio:device0", "in_accel_scale", "1");
    expect_error("bmi160", "it reads 1176.00 m/s2");
}

static void test_moving(void)
{
    put_raw("iio:device0", "40", "-981", "0");
    shake_raw[0] = -40;
    shake_raw[1] = 40;
    expect_up(0.0, -1.0, 0.0);
    TEST_ASSERT_EQUAL_INT(HAL_IIO_SAMPLES, pause_count);
    put_raw("iio:device0", "60", "-981", "0");
    shake_raw[0] = -60;
    shake_raw[1] = 60;
    expect_error("bmi160",
                 "it moves: readings are up to 0.60 m/s2 from their mean, expected at most 0.5");
}

int main(void)
{
    strcpy(root, "/tmp/isohead_iio_XXXXXX");
    if (mkdtemp(root) == NULL) {
        return 1;
    }
    UNITY_BEGIN();
    RUN_TEST(test_names);
    RUN_TEST(test_scale_and_offset);
    RUN_TEST(test_mount_matrix);
    RUN_TEST(test_matrices_that_are_none);
    RUN_TEST(test_no_such_device);
    RUN_TEST(test_unreadable);
    RUN_TEST(test_not_gravity);
    RUN_TEST(test_moving);
    rmdir(root);
    return UNITY_END();
}
