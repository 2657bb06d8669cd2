#include "golden_hash.h"

#include <stddef.h>

#include "detect/ih_score.h"

void golden_inner_start(struct ih_exposure *exposure)
{
    struct ih_exposure_params params;
    ih_exposure_params_default(&params);
    ih_exposure_start(&params, 4000, 128, exposure);
}

static uint64_t hash_noise(struct ih_dots_scratch *scratch, const struct ih_frame *frame,
                           const struct ih_frame *ambient)
{
    const struct ih_noise *noise = &scratch->noise;
    ih_noise_measure(frame, ambient, &scratch->rows.measuring, &scratch->noise);
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, noise->columns);
    hash = golden_add_word(hash, noise->rows);
    for (int32_t row = 0; row < noise->rows; row++) {
        for (int32_t column = 0; column < noise->columns; column++) {
            hash = golden_add_word(hash, noise->median[row][column]);
            hash = golden_add_word(hash, noise->subtract[row][column]);
        }
    }
    return hash;
}

static uint64_t hash_exposure(const struct isohead *head, const struct ih_frame *frame,
                              struct ih_exposure *exposure)
{
    struct ih_exposure_params params;
    struct ih_exposure_look look;
    ih_exposure_params_default(&params);
    ih_exposure_look(&head->dots, &head->labels, frame->width, frame->height, &look);
    ih_exposure_next(&params, &look, exposure);
    uint64_t hash = golden_add_words(GOLDEN_FNV_START, &look, sizeof look);
    return golden_add_words(hash, exposure, sizeof *exposure);
}

static uint64_t add_contours(uint64_t hash, const struct ih_contours *contours)
{
    hash = golden_add_word(hash, contours->contour_count);
    hash = golden_add_word(hash, contours->contours_dropped);
    for (int32_t i = 0; i < contours->contour_count; i++) {
        hash = golden_add_word(hash, contours->contour[i].first);
        hash = golden_add_word(hash, contours->contour[i].vertex_count);
        hash = golden_add_word(hash, contours->contour[i].closed);
    }
    for (int32_t i = 0; i < contours->vertex_count; i++) {
        hash = golden_add_word(hash, contours->vertex[i].x_q9);
        hash = golden_add_word(hash, contours->vertex[i].y_q9);
    }
    return hash;
}

static uint64_t add_ellipses(uint64_t hash, const struct ih_contours *contours)
{
    for (int32_t i = 0; i < contours->contour_count; i++) {
        struct ih_ellipse ellipse;
        if (contours->contour[i].closed &&
            ih_ellipse_of_contour(contours, &contours->contour[i], &ellipse)) {
            hash = golden_add_words(hash, &ellipse, sizeof ellipse);
        }
    }
    return hash;
}

static void hash_levels(struct isohead *head, uint64_t hash[GOLDEN_INNERS])
{
    struct ih_contours *contours = &head->scratch.nests.contours;
    int32_t level_mm_q8 = 0;
    for (int32_t i = 0; ih_nests_level(&head->surface, &head->params.nests, i, &level_mm_q8); i++) {
        ih_contours_level(&head->surface, level_mm_q8, contours);
        hash[GOLDEN_CONTOURS] =
            add_contours(golden_add_word(hash[GOLDEN_CONTOURS], level_mm_q8), contours);
        hash[GOLDEN_ELLIPSES] = add_ellipses(hash[GOLDEN_ELLIPSES], contours);
    }
}

/* A head fitted from one start, what speaks for it, and its score. */
static void hash_start(struct isohead *head, const int32_t centre_mm_q8[3],
                       uint64_t hash[GOLDEN_INNERS])
{
    const struct ih_rays *rays = &head->scratch.detections.rays;
    const struct ih_fit_params *params = &head->params.detections.fit;
    const struct ih_ellipsoid start = ih_ellipsoid_mean(centre_mm_q8);
    struct ih_fit fit;
    struct ih_evidence evidence;
    struct ih_surroundings surroundings;
    int32_t answer_q8[IH_SURROUNDINGS_MAPS];
    struct ih_score score;
    ih_fit_begin(&start, &fit);
    ih_fit_continue(rays, params, params->step_count, &head->scratch.detections.fit, &fit);
    ih_evidence_collect(rays, &fit.ellipsoid, centre_mm_q8, &evidence);
    ih_surroundings_find(rays, &fit.ellipsoid, &surroundings);
    ih_surroundings_ask(&surroundings, answer_q8);
    ih_score_rate(&evidence, answer_q8, &score);
    hash[GOLDEN_FIT] = golden_add_words(hash[GOLDEN_FIT], &fit.ellipsoid, sizeof fit.ellipsoid);
    hash[GOLDEN_EVIDENCE] = golden_add_words(hash[GOLDEN_EVIDENCE], &evidence, sizeof evidence);
    hash[GOLDEN_SCORE] = golden_add_words(hash[GOLDEN_SCORE], &score, sizeof score);
}

static void hash_candidates(struct isohead *head, uint64_t hash[GOLDEN_INNERS])
{
    const struct ih_dots *dots = head->rig.calibration.kind == IH_RIG_DOTS ? &head->dots : NULL;
    struct ih_detections_scratch *scratch = &head->scratch.detections;
    const struct ih_scan *scan = &scratch->scan;
    ih_rays_make(&head->points, dots, &head->rig, &head->params.detections.rays, &scratch->rays);
    ih_scan_find(&scratch->rays, &head->params.detections.scan, &scratch->scan_scratch,
                 &scratch->scan);
    hash[GOLDEN_RAYS] =
        golden_add_words(hash[GOLDEN_RAYS], &scratch->rays, offsetof(struct ih_rays, table));
    hash[GOLDEN_SCAN] = golden_add_word(hash[GOLDEN_SCAN], scan->candidate_count);
    hash[GOLDEN_SCAN] = golden_add_words(hash[GOLDEN_SCAN], scan->candidate,
                                         (size_t)scan->candidate_count * sizeof scan->candidate[0]);
    for (int32_t i = 0; i < scan->candidate_count; i++) {
        hash_start(head, scan->candidate[i].centre_mm_q8, hash);
    }
    for (int32_t i = 0; i < head->hypotheses.hypothesis_count; i++) {
        hash_start(head, head->hypotheses.hypothesis[i].centre_mm_q8, hash);
    }
}

static uint64_t hash_paper(struct isohead *head)
{
    static struct ih_params params;
    static struct ih_result result;
    ih_params_paper(&params);
    ih_surface_fit(&head->samples, &head->points.field, &params.surface, &head->scratch.surface,
                   &head->surface);
    ih_nests_find(&head->surface, &params.nests, &head->scratch.nests, &head->nests);
    ih_hypotheses_select(&head->nests, &head->surface, &head->samples, &head->rig,
                         &params.hypotheses, &head->hypotheses);
    ih_result_from_hypotheses(&head->hypotheses, &head->rig, &result);
    uint64_t hash = golden_add_words(GOLDEN_FNV_START, head->surface.depth_mm_q8,
                                     sizeof head->surface.depth_mm_q8);
    hash = golden_add_word(hash, result.entry_count);
    hash = golden_add_word(hash, result.selected);
    for (int32_t i = 0; i < result.entry_count; i++) {
        const struct ih_result_entry *entry = &result.entry[i];
        hash = golden_add_word(hash, entry->u_px_q12);
        hash = golden_add_word(hash, entry->v_px_q12);
        hash = golden_add_words(hash, entry->centre_mm_q8, sizeof entry->centre_mm_q8);
        hash = golden_add_word(hash, entry->rejected);
    }
    return hash;
}

/* Structs that golden_add_words takes: a member of another type would change these sizes. */
#define WORDS(n) ((n) * sizeof(int32_t))
_Static_assert(sizeof(struct ih_exposure_look) == WORDS(4), "ih_exposure_look");
_Static_assert(sizeof(struct ih_exposure) == WORDS(4), "ih_exposure");
_Static_assert(sizeof(struct ih_ellipse) == WORDS(9), "ih_ellipse");
_Static_assert(offsetof(struct ih_rays, table) == WORDS(3 + 6 * IH_SLOTS), "ih_rays");
_Static_assert(sizeof(struct ih_scan_candidate) == WORDS(4), "ih_scan_candidate");
_Static_assert(sizeof(struct ih_score) == WORDS(2 + IH_SCORE_PARTS), "ih_score");

const char *const golden_inner_name[GOLDEN_INNERS] = {
    "noise", "exposure", "cuts", "ellipses", "space", "scan", "fit", "evidence", "score", "paper"};

void golden_inner_hash(struct isohead *head, const struct ih_frame *frame,
                       const struct ih_frame *ambient, struct ih_exposure *exposure,
                       uint64_t hash[GOLDEN_INNERS])
{
    for (int i = 0; i < GOLDEN_INNERS; i++) {
        hash[i] = GOLDEN_FNV_START;
    }
    if (head->rig.calibration.kind == IH_RIG_DOTS) {
        hash[GOLDEN_NOISE] = hash_noise(&head->scratch.dots, frame, ambient);
        hash[GOLDEN_EXPOSURE] = hash_exposure(head, frame, exposure);
    }
    hash_levels(head, hash);
    hash_candidates(head, hash);
    hash[GOLDEN_PAPER] = hash_paper(head);
}
