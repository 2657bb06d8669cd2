#include "sim_record.h"

#include "sim_write.h"

#define PIXEL_DECIMALS 2
#define MM_DECIMALS 1
#define PROBABILITY_DECIMALS 3

static void write_pair_px(struct sim_write *write, const char *key, int32_t first_px_q12,
                          int32_t second_px_q12)
{
    sim_write_key(write, key);
    sim_write_open(write, '[');
    sim_write_decimal(write, sim_text_fixed(first_px_q12, 12, PIXEL_DECIMALS));
    sim_write_decimal(write, sim_text_fixed(second_px_q12, 12, PIXEL_DECIMALS));
    sim_write_close(write, ']');
}

static void write_hypothesis(struct sim_write *write, const struct ih_result_entry *hypothesis)
{
    sim_write_open(write, '{');
    write_pair_px(write, "pixel", hypothesis->u_px_q12, hypothesis->v_px_q12);
    write_pair_px(write, "axes_px", hypothesis->a_px_q12, hypothesis->b_px_q12);
    sim_write_key(write, "angle_deg");
    sim_write_decimal(write, sim_text_angle(hypothesis->angle_mdeg));
    sim_write_key(write, "distance_mm");
    sim_write_decimal(write, sim_text_fixed(hypothesis->distance_mm_q8, 8, MM_DECIMALS));
    sim_write_key(write, "centre_mm");
    sim_write_open(write, '[');
    for (int axis = 0; axis < 3; axis++) {
        sim_write_decimal(write, sim_text_fixed(hypothesis->centre_mm_q8[axis], 8, MM_DECIMALS));
    }
    sim_write_close(write, ']');
    sim_write_key(write, "rejected");
    sim_write_string_or_null(write, ih_reject_text(hypothesis->rejected));
    if (hypothesis->has_probability) {
        sim_write_key(write, "score");
        sim_write_decimal(write,
                          sim_text_fixed(hypothesis->probability_q16, 16, PROBABILITY_DECIMALS));
    }
    if (hypothesis->track_id != 0) {
        sim_write_int_field(write, "track", hypothesis->track_id);
        sim_write_key(write, "sigma_mm");
        sim_write_decimal(write, sim_text_fixed(hypothesis->sigma_mm_q8, 8, MM_DECIMALS));
    }
    if (hypothesis->is_predicted) {
        sim_write_key(write, "predicted");
        sim_write_bool(write, true);
    }
    sim_write_close(write, '}');
}

static void write_result(struct sim_write *write, const struct ih_result *result)
{
    sim_write_key(write, "hypotheses");
    sim_write_open(write, '[');
    for (int32_t i = 0; i < result->entry_count; i++) {
        write_hypothesis(write, &result->entry[i]);
    }
    sim_write_close(write, ']');
    sim_write_key(write, "heads");
    sim_write_open(write, '[');
    for (int32_t i = 0; i < result->head_count; i++) {
        sim_write_int(write, result->head[i]);
    }
    sim_write_close(write, ']');
    sim_write_key(write, "head");
    if (result->selected == IH_NONE) {
        sim_write_null(write);
    } else {
        sim_write_int(write, result->selected);
    }
}

static void write_dropped(struct sim_write *write, const struct isohead *head)
{
    const struct {
        const char *key;
        int32_t count;
    } dropped[] = {
        {"dots", head->dots.dots_dropped},
        {"candidates", head->labels.candidates_dropped},
        {"minima", head->hypotheses.minima_dropped},
        {"contours", head->hypotheses.contours_dropped},
        {"places", head->windows.places_dropped},
        {"findings", head->findings.dropped_count},
    };
    bool any = false;
    for (size_t i = 0; i < sizeof dropped / sizeof dropped[0]; i++) {
        if (dropped[i].count == 0) {
            continue;
        }
        if (!any) {
            sim_write_key(write, "dropped");
            sim_write_open(write, '{');
            any = true;
        }
        sim_write_int_field(write, dropped[i].key, dropped[i].count);
    }
    if (any) {
        sim_write_close(write, '}');
    }
}

static struct sim_write begin(const struct sim_record *record, const char *name)
{
    struct sim_write write = {.file = record->file};
    sim_write_open(&write, '{');
    sim_write_key(&write, "file");
    sim_write_string(&write, name);
    return write;
}

/* Flushed, so that a reader at the other end of a pipe has each record at once. */
static void end(const struct sim_record *record, struct sim_write *write)
{
    if (record->dir != NULL) {
        sim_write_key(write, "dir");
        sim_write_string(write, record->dir);
    }
    sim_write_close(write, '}');
    fputc('\n', record->file);
    fflush(record->file);
}

void sim_record_frame(const struct sim_record *record, const struct hal_frame *frame,
                      const struct isohead *head)
{
    struct sim_write write = begin(record, frame->name);
    sim_write_int_field(&write, "time_us", frame->time_us);
    sim_write_int_field(&write, "dots", head->dots.dot_count);
    sim_write_int_field(&write, "labelled", head->labels.labelled_count);
    write_result(&write, &head->result);
    if (head->rig.calibration.kind == IH_RIG_RANGE) {
        sim_write_int_field(&write, "points", head->points.seen_count);
    }
    write_dropped(&write, head);
    end(record, &write);
}

void sim_record_error(const struct sim_record *record, const char *name, const char *error)
{
    struct sim_write write = begin(record, name);
    sim_write_key(&write, "error");
    sim_write_string(&write, error);
    end(record, &write);
}
