#include "golden_inner.h"

#include "golden_fnv.h"

void golden_inner_start(struct ih_exposure *exposure)
{
    struct ih_exposure_params params;
    ih_exposure_params_default(&params);
    ih_exposure_start(&params, 4000, 128, exposure);
}

static uint64_t hash_noise(const struct golden_inner_view *view)
{
    struct ih_dots_scratch *scratch = &view->head->scratch.dots;
    const struct ih_noise *noise = &scratch->noise;
    ih_noise_measure(view->frame, view->ambient, &scratch->rows.measuring, &scratch->noise);
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

static uint64_t hash_exposure(const struct golden_inner_view *view)
{
    const struct isohead *head = view->head;
    struct ih_exposure_params params;
    struct ih_exposure_look look;
    ih_exposure_params_default(&params);
    ih_exposure_look(&head->dots, &head->labels, view->frame->width, view->frame->height, &look);
    ih_exposure_next(&params, &look, view->exposure);
    uint64_t hash = golden_add_words(GOLDEN_FNV_START, &look, sizeof look);
    return golden_add_words(hash, view->exposure, sizeof *view->exposure);
}

static uint64_t add_contours(uint64_t hash, const struct ih_cuts *cuts)
{
    hash = golden_add_word(hash, cuts->contour_count);
    hash = golden_add_word(hash, cuts->contours_dropped);
    for (int32_t i = 0; i < cuts->contour_count; i++) {
        hash = golden_add_word(hash, cuts->contour[i].first);
        hash = golden_add_word(hash, cuts->contour[i].vertex_count);
        hash = golden_add_word(hash, cuts->contour[i].closed);
    }
    for (int32_t i = 0; i < cuts->vertex_count; i++) {
        hash = golden_add_word(hash, cuts->vertex[i].x_q9);
        hash = golden_add_word(hash, cuts->vertex[i].y_q9);
    }
    return hash;
}

static uint64_t add_ellipses(uint64_t hash, const struct ih_cuts *cuts)
{
    for (int32_t i = 0; i < cuts->contour_count; i++) {
        struct ih_ellipse ellipse;
        if (cuts->contour[i].closed && ih_ellipse_of_contour(cuts, &cuts->contour[i], &ellipse)) {
            hash = golden_add_words(hash, &ellipse, sizeof ellipse);
        }
    }
    return hash;
}

static uint64_t over_levels(const struct golden_inner_view *view,
                            uint64_t (*add)(uint64_t hash, const struct ih_cuts *cuts))
{
    struct isohead *head = view->head;
    struct ih_cuts *cuts = &head->scratch.hypotheses.cuts;
    uint64_t hash = GOLDEN_FNV_START;
    int32_t level_mm_q8 = 0;
    for (int32_t i = 0;
         ih_hypotheses_level(&head->surface, &head->params.hypotheses, i, &level_mm_q8); i++) {
        ih_cuts_level(&head->surface, level_mm_q8, cuts);
        hash = add(golden_add_word(hash, level_mm_q8), cuts);
    }
    return hash;
}

static uint64_t hash_cuts(const struct golden_inner_view *view)
{
    return over_levels(view, add_contours);
}

static uint64_t hash_ellipses(const struct golden_inner_view *view)
{
    return over_levels(view, add_ellipses);
}

static void make_space(const struct golden_inner_view *view)
{
    struct isohead *head = view->head;
    const struct ih_dots *dots = head->rig.calibration.kind == IH_RIG_DOTS ? &head->dots : NULL;
    ih_space_make(&head->points, dots, &head->rig, &head->params.findings.space,
                  &head->scratch.findings.space);
}

static const struct ih_scan *make_scan(const struct golden_inner_view *view)
{
    struct ih_findings_scratch *scratch = &view->head->scratch.findings;
    make_space(view);
    ih_scan_find(&scratch->space, &view->head->params.findings.scan, &scratch->scan_scratch,
                 &scratch->scan);
    return &scratch->scan;
}

static uint64_t hash_space(const struct golden_inner_view *view)
{
    const struct ih_space *space = &view->head->scratch.findings.space;
    make_space(view);
    return golden_add_words(GOLDEN_FNV_START, space, sizeof *space);
}

static uint64_t hash_scan(const struct golden_inner_view *view)
{
    const struct ih_scan *scan = make_scan(view);
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, scan->place_count);
    return golden_add_words(hash, scan->place, (size_t)scan->place_count * sizeof scan->place[0]);
}

/* What the stages from the fit on make of one start. */
struct candidate {
    struct ih_ellipsoid head;
    struct ih_evidence evidence;
    struct ih_score score;
};

static struct candidate try_start(const struct golden_inner_view *view,
                                  const int32_t centre_mm_q8[3])
{
    const struct ih_space *space = &view->head->scratch.findings.space;
    const struct ih_evidence_nest nest = {.present = false};
    struct ih_ellipsoid start = ih_ellipsoid_mean(centre_mm_q8);
    struct candidate out;
    ih_fit_ellipsoid(space, &view->head->params.findings.fit, &start, &out.head);
    ih_evidence_collect(space, &out.head, centre_mm_q8, &nest, &out.evidence);
    ih_score_rate(&out.evidence, &out.score);
    return out;
}

static uint64_t over_starts(const struct golden_inner_view *view,
                            uint64_t (*add)(uint64_t hash, const struct candidate *candidate))
{
    const struct ih_heads *heads = &view->head->heads;
    const struct ih_scan *scan = make_scan(view);
    uint64_t hash = GOLDEN_FNV_START;
    for (int32_t i = 0; i < scan->place_count + heads->hypothesis_count; i++) {
        const struct candidate candidate = try_start(
            view, i < scan->place_count ? scan->place[i].centre_mm_q8
                                        : heads->hypothesis[i - scan->place_count].centre_mm_q8);
        hash = add(hash, &candidate);
    }
    return hash;
}

static uint64_t add_fit(uint64_t hash, const struct candidate *candidate)
{
    return golden_add_words(hash, &candidate->head, sizeof candidate->head);
}

static uint64_t add_evidence(uint64_t hash, const struct candidate *candidate)
{
    return golden_add_words(hash, &candidate->evidence, sizeof candidate->evidence);
}

static uint64_t add_score(uint64_t hash, const struct candidate *candidate)
{
    return golden_add_words(hash, &candidate->score, sizeof candidate->score);
}

static uint64_t hash_fit(const struct golden_inner_view *view)
{
    return over_starts(view, add_fit);
}

static uint64_t hash_evidence(const struct golden_inner_view *view)
{
    return over_starts(view, add_evidence);
}

static uint64_t hash_score(const struct golden_inner_view *view)
{
    return over_starts(view, add_score);
}

static uint64_t hash_paper(const struct golden_inner_view *view)
{
    struct ih_result result;
    ih_result_from_heads(&view->head->heads, &result);
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, result.entry_count);
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
_Static_assert(sizeof(struct ih_space) == WORDS(3 + 6 * IH_SLOTS), "ih_space");
_Static_assert(sizeof(struct ih_scan_place) == WORDS(4), "ih_scan_place");
_Static_assert(sizeof(struct ih_score) == WORDS(2 + IH_EVIDENCE_COUNT), "ih_score");

const struct golden_inner golden_inner[GOLDEN_INNERS] = {
    {"noise", true, hash_noise},  {"exposure", true, hash_exposure},
    {"cuts", false, hash_cuts},   {"ellipses", false, hash_ellipses},
    {"space", false, hash_space}, {"scan", false, hash_scan},
    {"fit", false, hash_fit},     {"evidence", false, hash_evidence},
    {"score", false, hash_score}, {"paper", false, hash_paper},
};
