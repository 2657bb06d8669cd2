#include "sim_table.h"

#include <inttypes.h>
#include <string.h>

#include "app_rig_text.h"
#include "app_text.h"

#define LABEL_WIDTH 20
#define FRAME_WIDTH 14
#define NAME_MAX_BYTES 256

static const char *const outcome_text[SIM_OUTCOMES] = {"correct", "ambiguous", "wrong", "not done"};

const char *sim_table_outcome(enum sim_outcome outcome)
{
    return outcome_text[outcome];
}

/* A name from the disk, safe for a terminal. */
static const char *tame(char *buffer, size_t size, const char *name)
{
    snprintf(buffer, size, "%s", name);
    app_text_tame(buffer);
    return buffer;
}

/* The end of a name that is too long tells directories and frames apart better than its beginning. */
static const char *shorten(char *buffer, size_t size, const char *name, size_t width)
{
    tame(buffer, size, name);
    size_t length = strlen(buffer);
    return length > width ? buffer + (length - width) : buffer;
}

void sim_table_title(FILE *file, const char *path)
{
    char name[NAME_MAX_BYTES];
    fprintf(file, "%s\n%-*s %5s %5s %4s %7s %7s %7s %6s  %s\n", tame(name, sizeof name, path),
            FRAME_WIDTH, "frame", "dots", "label", "hyp", "x mm", "y mm", "z mm", "dist", "head");
}

/* What the truth says of the selection: nothing is printed for a frame that is not scored. */
static void print_verdict(FILE *file, const struct sim_verdict *verdict)
{
    if (!verdict->scored) {
        return;
    }
    if (!verdict->head_there) {
        fputs(verdict->outcome == SIM_OUTCOME_NONE ? "right: empty" : "wrong: empty", file);
        return;
    }
    fputs(outcome_text[verdict->outcome], file);
    if (verdict->error_known) {
        fprintf(file, " %s mm", app_text_fixed(verdict->error_mm_q8, 8, 0).text);
    }
}

void sim_table_frame(FILE *file, const struct hal_frame *frame, const struct isohead *head,
                     const struct sim_verdict *verdict)
{
    char name[NAME_MAX_BYTES];
    const struct ih_result *result = &head->result;
    int32_t selected = result->selected;
    fprintf(file, "%-*s %5" PRId32 " %5" PRId32 " %4" PRId32 " ", FRAME_WIDTH,
            shorten(name, sizeof name, frame->name, FRAME_WIDTH), head->dots.dot_count,
            head->labels.labelled_count, result->entry_count);
    if (selected != IH_NONE) {
        const struct ih_result_entry *hypothesis = &result->entry[selected];
        for (int axis = 0; axis < 3; axis++) {
            fprintf(file, "%7s ", app_text_fixed(hypothesis->centre_mm_q8[axis], 8, 1).text);
        }
        fprintf(file, "%6s  ", app_text_fixed(hypothesis->distance_mm_q8, 8, 0).text);
    } else {
        fprintf(file, "%-32s", result->head_count > 1 ? "    ambiguous" : "         none");
    }
    print_verdict(file, verdict);
    fputc('\n', file);
    fflush(file);
}

void sim_table_rig(FILE *file, const struct isohead *head)
{
    const struct ih_alignment *now = &head->align.now;
    if (head->rig.calibration.kind == IH_RIG_RANGE || head->params.is_paper) {
        return;
    }
    fprintf(file, "  rig %s", app_rig_text(now->state));
    if (now->state == IH_ALIGN_MOVED) {
        fputs(":", file);
        for (int axis = 0; axis < 3; axis++) {
            fprintf(file, " %s", app_text_degrees(now->rotation_rad_q30[axis], 3).text);
        }
        fprintf(file, " degrees, focal %s %%, shift",
                app_text_fixed((int64_t)now->focal_q30 * 100, 30, 2).text);
        for (int axis = 0; axis < 2; axis++) {
            fprintf(file, " %s", app_text_fixed(now->shift_px_q12[axis], 12, 2).text);
        }
        fputs(" px\n  rig depth ", file);
        if (now->is_depth_known) {
            fprintf(file, "+-%s mm at 1 m", app_text_fixed(app_rig_depth_mm_q8(head), 8, 0).text);
        } else {
            fputs("not known", file);
        }
    }
    fputc('\n', file);
}

void sim_table_error(FILE *file, const char *name, const char *error)
{
    char text[NAME_MAX_BYTES];
    fprintf(file, "%-*s error: ", FRAME_WIDTH, tame(text, sizeof text, name));
    fprintf(file, "%s\n", tame(text, sizeof text, error));
    fflush(file);
}

void sim_table_heading(FILE *file)
{
    fprintf(file, "\nTable 1 (one row per directory; below it its frames without a head)\n");
    fprintf(file, "%-*s %6s %9s %7s %5s %5s %5s %6s %9s\n", LABEL_WIDTH, "", "", "head in",
            "correct", "with", "", "not", "head", "error mm");
    fprintf(file, "%-*s %6s %4s %4s %7s %5s %5s %5s %6s %4s %4s\n", LABEL_WIDTH, "", "frames",
            "yes", "no", "no amb.", "amb.", "wrong", "done", "right", "50%", "90%");
}

static void print_head_row(FILE *file, struct sim_score *score)
{
    const struct sim_counts *counts = &score->with_head;
    fprintf(file, " %6" PRId32 " %4" PRId32 " %4" PRId32 " %7" PRId32 " %5" PRId32 " %5" PRId32,
            counts->frame_count, counts->detected_count,
            counts->frame_count - counts->detected_count,
            counts->outcome_count[SIM_OUTCOME_CORRECT],
            counts->outcome_count[SIM_OUTCOME_AMBIGUOUS], counts->outcome_count[SIM_OUTCOME_WRONG]);
    fprintf(file, " %5" PRId32 " %6" PRId32, counts->outcome_count[SIM_OUTCOME_NONE],
            counts->selected_right_count);
    if (score->error_mm_q8.count > 0) {
        fprintf(file, " %4s", app_text_fixed(sim_list_rank(&score->error_mm_q8, 50), 8, 0).text);
        fprintf(file, " %4s", app_text_fixed(sim_list_rank(&score->error_mm_q8, 90), 8, 0).text);
    }
    fputc('\n', file);
}

void sim_table_row(FILE *file, const char *label, struct sim_score *score)
{
    char text[NAME_MAX_BYTES];
    const char *shown = shorten(text, sizeof text, label, LABEL_WIDTH);
    const struct sim_counts *empty = &score->empty;
    if (score->with_head.frame_count > 0) {
        fprintf(file, "%-*s", LABEL_WIDTH, shown);
        print_head_row(file, score);
        shown = "";
    }
    if (empty->frame_count > 0) {
        fprintf(file, "%-*s %6" PRId32 " %4s %4s %7s %5s %5" PRId32 " %5" PRId32 " %6" PRId32 "\n",
                LABEL_WIDTH, shown[0] != 0 ? shown : "  empty", empty->frame_count, "-", "-", "-",
                "-", empty->outcome_count[SIM_OUTCOME_WRONG],
                empty->outcome_count[SIM_OUTCOME_NONE], empty->selected_right_count);
    }
}

void sim_table_dots_heading(FILE *file)
{
    fprintf(file, "\nDots (found: a dot within %d px; errors of found dots and right labels)\n",
            SIM_SCORE_DOT_PX);
    fprintf(file, "%-*s %8s %7s %11s %8s %7s %11s\n", LABEL_WIDTH, "", "visible", "found",
            "error px", "labels", "right", "depth mm");
    fprintf(file, "%-*s %8s %7s %5s %5s %8s %7s %5s %5s\n", LABEL_WIDTH, "", "", "", "50%", "90%",
            "", "", "50%", "90%");
}

/* part / whole in percent to two decimals. */
static struct app_decimal percent(int32_t part, int32_t whole)
{
    /* A 24-bit fraction: its error is far below the last decimal. */
    return app_text_fixed(whole == 0 ? 0 : ((int64_t)part * 100 << 24) / whole, 24, 2);
}

static void print_ranks(FILE *file, struct sim_list *list, int fraction_bits)
{
    if (list->count == 0) {
        fprintf(file, " %5s %5s", "-", "-");
        return;
    }
    fprintf(file, " %5s", app_text_fixed(sim_list_rank(list, 50), fraction_bits, 2).text);
    fprintf(file, " %5s", app_text_fixed(sim_list_rank(list, 90), fraction_bits, 2).text);
}

void sim_table_dots_row(FILE *file, const char *label, struct sim_score *score)
{
    char text[NAME_MAX_BYTES];
    if (score->true_dot_count == 0) {
        return;
    }
    fprintf(file, "%-*s %8" PRId32 " %7s", LABEL_WIDTH,
            shorten(text, sizeof text, label, LABEL_WIDTH), score->true_dot_count,
            percent(score->found_dot_count, score->true_dot_count).text);
    print_ranks(file, &score->dot_error_px_q12, 12);
    fprintf(file, " %8" PRId32 " %7s", score->label_count,
            percent(score->right_label_count, score->label_count).text);
    print_ranks(file, &score->depth_error_mm_q8, 8);
    fputc('\n', file);
}
