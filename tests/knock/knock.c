/* knock DIR... - the frames of directories, one after the other, through ih_health, as isohead_board does it; the
 * rig is the first one's.
 *
 * Out:   per lit frame a line of JSON: the state, whether the rig was turned after it, turn and
 *        uncertainty, dots, labels and their mean distance of the last look, frames that the turn was
 *        had from; raw integers of struct ih_health.
 * Exit status: 0 every frame was processed, 1 something could not be read, 2 wrong usage.
 */
#include <inttypes.h>
#include <stdio.h>

#include "app_rig.h"
#include "app_view.h"
#include "isohead.h"
#include "upkeep/ih_health.h"
#include "replay/hal_replay.h"

static struct isohead head;
static struct ih_health health;
static struct ih_health_scratch scratch;

static int fail(const char *subject, const char *text)
{
    fprintf(stderr, "knock: %s: %s\n", subject, text);
    return 1;
}

static void log_error(void *context, const char *subject, const char *text)
{
    (void)context;
    fail(subject, text);
}

static void print_vector(const char *key, const int32_t value[3])
{
    printf(",\"%s\":[%" PRId32 ",%" PRId32 ",%" PRId32 "]", key, value[0], value[1], value[2]);
}

static void print_line(const char *name, bool has_changed)
{
    printf("{\"file\":\"%s\",\"state\":%d,\"changed\":%s", name, (int)health.state,
           has_changed ? "true" : "false");
    print_vector("turn_rad_q30", health.rotation_rad_q30);
    print_vector("sigma_rad_q30", health.sigma_rad_q30);
    printf(",\"dots\":%" PRId32 ",\"labelled\":%" PRId32 ",\"across_px_q12\":%" PRId32
           ",\"basis\":%" PRId32 "}\n",
           health.dot_count, health.labelled_count, health.across_px_q12, health.basis_count);
}

static enum ih_err use_frame(const struct hal_frame *frame, const struct ih_frame *ambient)
{
    struct ih_frame view = app_view_of(frame);
    enum ih_err err = isohead_label(&head, &view, ambient);
    if (err == IH_OK) {
        bool has_changed = ih_health_frame(&health, &head.dots, &head.labels, &head.rig, &scratch);
        print_line(frame->name, has_changed);
    }
    return err;
}

static int play_frames(const char *dir, const struct hal_camera *camera)
{
    struct hal_frame frame;
    struct hal_frame dark = {.samples = NULL};
    struct ih_frame ambient;
    struct hal_error error;
    enum hal_next next;
    enum ih_err err = IH_OK;
    while (err == IH_OK &&
           (next = camera->next(camera->context, &frame, &error)) == HAL_NEXT_FRAME) {
        if (frame.laser) {
            err = use_frame(&frame, dark.samples != NULL ? &ambient : NULL);
            camera->release(camera->context, &frame);
        } else {
            camera->release(camera->context, &dark);
            dark = frame;
            ambient = app_view_of(&dark);
        }
    }
    camera->release(camera->context, &dark);
    if (err != IH_OK) {
        return fail(dir, ih_err_text(err));
    }
    return next == HAL_NEXT_BAD ? fail(dir, error.text) : 0;
}

static int play(const char *dir)
{
    const struct hal_log log = {.error = log_error};
    struct hal_error error;
    struct hal_replay replay;
    if (!hal_replay_open(&replay, dir, false, &log, &error)) {
        return fail(dir, error.text);
    }
    int status = play_frames(dir, &replay.camera);
    hal_replay_close(&replay);
    return status;
}

int main(int argument_count, char **arguments)
{
    struct ih_calibration calibration;
    struct hal_error error;
    char path[4096];
    int32_t bad_slot;
    int status = 0;
    if (argument_count < 2) {
        fputs("Usage: knock DIR...\n", stderr);
        return 2;
    }
    const char *dir = arguments[1];
    snprintf(path, sizeof path, "%s/rig.json", dir);
    if (!app_rig_load(path, &calibration, &error)) {
        return fail(path, error.text);
    }
    if (calibration.kind != IH_RIG_DOTS) {
        return fail(path, "a range rig, expected one with a projector");
    }
    enum ih_err err = isohead_init(&head, &calibration, &bad_slot);
    if (err != IH_OK) {
        return fail(path, ih_err_text(err));
    }
    ih_health_init(&health, &head.rig);
    for (int i = 1; i < argument_count && status == 0; i++) {
        status = play(arguments[i]);
    }
    return status;
}
