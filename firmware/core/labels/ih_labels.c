#include "labels/ih_labels.h"

#include <string.h>

#include "labels/ih_label_growth.h"
#include "labels/ih_label_lines.h"
#include "labels/ih_label_seeds.h"

void ih_labels_params_default(struct ih_labels_params *params)
{
    *params = (struct ih_labels_params){
        .perp_max_px_q12 = 2458,    /* 0.6 px */
        .seed_max_px_q12 = 4096,    /* 1.0 px */
        .seed_margin_px_q12 = 2048, /* 0.5 px */
        .epsilon_min_px_q12 = 6144, /* 1.5 px */
        .epsilon_max_px_q12 = 8 * 4096,
    };
}

static void write_table(const struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    out->labelled_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->dot_of_slot[slot] = IH_NONE;
        out->t_px_q12[slot] = 0;
        out->perp_px_q12[slot] = 0;
        if (scratch->choice[slot] != IH_NONE) {
            const struct ih_candidate *c = ih_label_candidate(scratch, slot, scratch->choice[slot]);
            out->dot_of_slot[slot] = scratch->rows->dot[c->dot];
            out->t_px_q12[slot] = c->t_px_q12;
            out->perp_px_q12[slot] = c->perp_px_q12;
            out->labelled_count++;
        }
    }
}

void ih_labels_assign(const struct ih_dots *dots, const struct ih_dot_rows *rows,
                      const struct ih_rig *rig, const struct ih_labels_params *params,
                      struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    out->candidates_dropped = 0;
    scratch->rows = rows;
    memset(scratch->slot_of_dot, 0xff, sizeof scratch->slot_of_dot); /* IH_NONE */
    ih_label_lines_find(dots, rig, params, scratch, out);
    ih_label_seeds_assign(rig, params, scratch);
    out->seed_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->seed_count += scratch->choice[slot] != IH_NONE;
    }
    ih_label_growth_run(rig, params, scratch);
    write_table(scratch, out);
}
