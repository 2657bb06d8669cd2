#include "app_record.h"

#include "app_rig_text.h"
#include "app_write.h"

#define PIXEL_DECIMALS 2
#define MM_DECIMALS 1
#define PROBABILITY_DECIMALS 3
#define DEGREE_DECIMALS 3 /* of a rig */
#define PERCENT_DECIMALS 2

static void write_pair_px(struct app_write *write, const char *key, int32_t first_px_q12,
                          int32_t second_px_q12)
{
    app_write_key(write, key);
    app_write_open(write, '[');
    app_write_decimal(write, app_text_fixed(first_px_q12, 12, PIXEL_DECIMALS));
    app_write_decimal(write, app_text_fixed(second_px_q12, 12, PIXEL_DECIMALS));
    app_write_close(write, ']');
}

static void write_directions(struct app_write *write, const char *key, int32_t yaw_mdeg,
                             int32_t pitch_mdeg)
{
    app_write_key(write, key);
    app_write_open(write, '[');
    app_write_decimal(write, app_text_direction(yaw_mdeg));
    app_write_decimal(write, app_text_direction(pitch_mdeg));
    app_write_close(write, ']');
}

static void write_pose(struct app_write *write, const struct ih_head_pose *pose)
{
    if (pose->is_known) {
        write_directions(write, "pose_deg", pose->yaw_mdeg, pose->pitch_mdeg);
        write_directions(write, "pose_sigma_deg", pose->yaw_sigma_mdeg, pose->pitch_sigma_mdeg);
        return;
    }
    app_write_key(write, "pose_deg");
    app_write_null(write);
    app_write_key(write, "pose_sigma_deg");
    app_write_null(write);
}

static void write_hypothesis(struct app_write *write, const struct ih_result_entry *hypothesis)
{
    app_write_open(write, '{');
    write_pair_px(write, "pixel", hypothesis->u_px_q12, hypothesis->v_px_q12);
    write_pair_px(write, "axes_px", hypothesis->a_px_q12, hypothesis->b_px_q12);
    app_write_key(write, "angle_deg");
    app_write_decimal(write, app_text_angle(hypothesis->angle_mdeg));
    app_write_key(write, "distance_mm");
    app_write_decimal(write, app_text_fixed(hypothesis->distance_mm_q8, 8, MM_DECIMALS));
    app_write_key(write, "centre_mm");
    app_write_open(write, '[');
    for (int axis = 0; axis < 3; axis++) {
        app_write_decimal(write, app_text_fixed(hypothesis->centre_mm_q8[axis], 8, MM_DECIMALS));
    }
    app_write_close(write, ']');
    app_write_key(write, "rejected");
    app_write_string_or_null(write, ih_reject_text(hypothesis->rejected));
    if (hypothesis->has_probability) {
        app_write_key(write, "score");
        app_write_decimal(write,
                          app_text_fixed(hypothesis->probability_q16, 16, PROBABILITY_DECIMALS));
    }
    if (hypothesis->has_probability && !hypothesis->is_predicted) {
        app_write_key(write, "frame_score");
        app_write_decimal(
            write, app_text_fixed(hypothesis->frame_probability_q16, 16, PROBABILITY_DECIMALS));
    }
    if (hypothesis->track_id != 0) {
        app_write_int_field(write, "track", hypothesis->track_id);
        app_write_key(write, "sigma_mm");
        app_write_decimal(write, app_text_fixed(hypothesis->sigma_mm_q8, 8, MM_DECIMALS));
        write_pose(write, &hypothesis->pose);
    }
    if (hypothesis->is_predicted) {
        app_write_key(write, "predicted");
        app_write_bool(write, true);
    }
    app_write_close(write, '}');
}

static void write_result(struct app_write *write, const struct ih_result *result)
{
    app_write_key(write, "hypotheses");
    app_write_open(write, '[');
    for (int32_t i = 0; i < result->entry_count; i++) {
        write_hypothesis(write, &result->entry[i]);
    }
    app_write_close(write, ']');
    app_write_key(write, "heads");
    app_write_open(write, '[');
    for (int32_t i = 0; i < result->head_count; i++) {
        app_write_int(write, result->head[i]);
    }
    app_write_close(write, ']');
    app_write_key(write, "head");
    if (result->selected == IH_NONE) {
        app_write_null(write);
    } else {
        app_write_int(write, result->selected);
    }
}

static void write_dropped(struct app_write *write, const struct isohead *head)
{
    const struct {
        const char *key;
        int32_t count;
    } dropped[] = {
        {"dots", head->dots.dots_dropped},        {"candidates", head->labels.candidates_dropped},
        {"minima", head->nests.minima_dropped},   {"contours", head->nests.contours_dropped},
        {"places", head->windows.places_dropped}, {"findings", head->detections.dropped_count},
    };
    bool any = false;
    for (size_t i = 0; i < sizeof dropped / sizeof dropped[0]; i++) {
        if (dropped[i].count == 0) {
            continue;
        }
        if (!any) {
            app_write_key(write, "dropped");
            app_write_open(write, '{');
            any = true;
        }
        app_write_int_field(write, dropped[i].key, dropped[i].count);
    }
    if (any) {
        app_write_close(write, '}');
    }
}

static struct app_write begin(struct app_record *record, const char *name)
{
    struct app_write write = {.memory = record->text, .size = sizeof record->text};
    app_write_open(&write, '{');
    app_write_key(&write, "file");
    app_write_string(&write, name);
    return write;
}

static bool end(struct app_record *record, struct app_write *write)
{
    if (record->dir != NULL) {
        app_write_key(write, "dir");
        app_write_string(write, record->dir);
    }
    app_write_close(write, '}');
    app_write_line_end(write);
    record->length = write->full ? 0 : write->length;
    return !write->full;
}

static void write_angles(struct app_write *write, const char *key, const int32_t angle_rad_q30[3])
{
    app_write_key(write, key);
    app_write_open(write, '[');
    for (int axis = 0; axis < 3; axis++) {
        app_write_decimal(write, app_text_degrees(angle_rad_q30[axis], DEGREE_DECIMALS));
    }
    app_write_close(write, ']');
}

static void write_rig(struct app_write *write, const struct ih_alignment *now)
{
    app_write_key(write, "rig");
    app_write_open(write, '{');
    app_write_key(write, "state");
    app_write_string(write, app_rig_text(now->state));
    app_write_key(write, "across_px");
    if (now->across_px_q12 < 0) {
        app_write_null(write);
    } else {
        app_write_decimal(write, app_text_fixed(now->across_px_q12, 12, PIXEL_DECIMALS));
    }
    write_angles(write, "rotation_deg", now->rotation_rad_q30);
    write_angles(write, "sigma_deg", now->sigma_rad_q30);
    app_write_key(write, "focal_percent");
    app_write_decimal(write, app_text_fixed((int64_t)now->focal_q30 * 100, 30, PERCENT_DECIMALS));
    write_pair_px(write, "shift_px", now->shift_px_q12[0], now->shift_px_q12[1]);
    app_write_key(write, "depth_known");
    app_write_bool(write, now->is_depth_known);
    app_write_close(write, '}');
}

static void write_live(struct app_write *write, const struct app_record_live *live,
                       const struct isohead *head)
{
    const int32_t across_px_q12 = head->align.now.across_px_q12;
    if (live->lost_count != 0) {
        app_write_int_field(write, "lost", live->lost_count);
    }
    if (live->skipped_count != 0) {
        app_write_int_field(write, "skipped", live->skipped_count);
    }
    if (live->strobe != NULL) {
        app_write_key(write, "strobe");
        app_write_string(write, live->strobe);
    }
    if (head->labels.labelled_count > 0 && !head->params.is_paper && across_px_q12 >= 0) {
        app_write_key(write, "across_px");
        app_write_decimal(write, app_text_fixed(across_px_q12, 12, PIXEL_DECIMALS));
    }
}

bool app_record_frame(struct app_record *record, const struct hal_frame *frame,
                      const struct isohead *head, const struct app_record_live *live)
{
    struct app_write write = begin(record, frame->name);
    app_write_int_field(&write, "time_us", frame->time_us);
    app_write_int_field(&write, "dots", head->dots.dot_count);
    app_write_int_field(&write, "labelled", head->labels.labelled_count);
    write_result(&write, &head->result);
    if (head->rig.calibration.kind == IH_RIG_RANGE) {
        app_write_int_field(&write, "points", head->points.seen_count);
    } else if (!head->params.is_paper) {
        write_rig(&write, &head->align.now);
    }
    write_dropped(&write, head);
    if (live != NULL) {
        write_live(&write, live, head);
    }
    return end(record, &write);
}

bool app_record_error(struct app_record *record, const char *name, const char *error)
{
    struct app_write write = begin(record, name);
    app_write_key(&write, "error");
    app_write_string(&write, error);
    return end(record, &write);
}
