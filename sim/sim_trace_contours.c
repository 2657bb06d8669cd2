#include "sim_trace_contours.h"

#include <stdlib.h>

/* An arc; its chord leads from the last point back to the first. */
struct arc {
    int32_t vertex_count;
    struct ih_vertex vertex[IH_ARCS_POINTS_MAX];
};

static bool is_same(const struct ih_ellipse *a, const struct ih_ellipse *b)
{
    return a->area_q16 == b->area_q16 && a->x_q16 == b->x_q16 && a->y_q16 == b->y_q16 &&
           a->merit_q8 == b->merit_q8;
}

/* Has the stretch from..to, closed by its chord, the ellipse's area and centre? The area is the
 * core's to the last bit, the centre within 1/256 step. */
static bool has_moments(const struct ih_arcs *arcs, int32_t from, int32_t to,
                        const struct ih_ellipse *ellipse)
{
    const struct ih_arcs_sums *sums = &arcs->sums;
    const int64_t px = arcs->dx_q8[to], py = arcs->dy_q8[to];
    const int64_t qx = arcs->dx_q8[from], qy = arcs->dy_q8[from];
    const int64_t w = px * qy - qx * py;
    const uint32_t wrapped = sums->area2_q16[to] - sums->area2_q16[from] + (uint32_t)w;
    const int64_t area2_q16 = (int32_t)wrapped;
    if (area2_q16 / 2 != ellipse->area_q16 || area2_q16 <= 0) {
        return false;
    }
    /* About the middle of the outline. */
    const int64_t x_q8 = (sums->x_q24[to] - sums->x_q24[from] + w * (px + qx)) / (3 * area2_q16);
    const int64_t y_q8 = (sums->y_q24[to] - sums->y_q24[from] + w * (py + qy)) / (3 * area2_q16);
    return llabs(x_q8 + arcs->x_q8[0] - arcs->dx_q8[0] - ellipse->x_q16 / 256) <= 1 &&
           llabs(y_q8 + arcs->y_q8[0] - arcs->dy_q8[0] - ellipse->y_q16 / 256) <= 1;
}

static void copy_stretch(const struct ih_arcs *arcs, int32_t from, int32_t to, struct arc *out)
{
    out->vertex_count = to - from + 1;
    for (int32_t i = 0; i < out->vertex_count; i++) {
        out->vertex[i].x_q9 = (int16_t)(2 * arcs->x_q8[from + i]);
        out->vertex[i].y_q9 = (int16_t)(2 * arcs->y_q8[from + i]);
    }
}

/* scratch->arcs are the contour's. False: the slice's arc is not of this contour. */
static bool find_arc(struct ih_nests_scratch *scratch, const struct ih_nest *nest,
                     const struct ih_slice *slice, const struct ih_ellipse_params *params,
                     struct arc *out)
{
    const struct ih_arcs *arcs = &scratch->arcs;
    struct ih_ellipse ellipse;
    if (!ih_ellipse_of_part(arcs, nest->minimum, params, &scratch->ellipse, &ellipse) ||
        !is_same(&ellipse, &slice->ellipse)) {
        return false;
    }
    for (int32_t from = 0; from < arcs->point_count; from++) {
        for (int32_t to = from + 1; to < arcs->count && to < from + arcs->point_count; to++) {
            if (has_moments(arcs, from, to, &ellipse)) {
                copy_stretch(arcs, from, to, out);
                return true;
            }
        }
    }
    return false;
}

static void write_vertices(struct app_write *write, const struct ih_vertex *vertex, int32_t count)
{
    app_write_key(write, "x_y_q9");
    app_write_open(write, '[');
    for (int32_t i = 0; i < count; i++) {
        app_write_open(write, '[');
        app_write_int(write, vertex[i].x_q9);
        app_write_int(write, vertex[i].y_q9);
        app_write_close(write, ']');
    }
    app_write_close(write, ']');
}

/* The arcs of the contour that support a nest at this level. */
static void write_arcs(struct app_write *write, struct isohead *head,
                       const struct ih_contour *contour)
{
    struct ih_nests_scratch *scratch = &head->scratch.nests;
    const struct ih_ellipse_params *params = &head->params.nests.ellipse;
    const struct ih_box box = ih_arcs_box(&scratch->contours, contour);
    const bool is_searched = ih_arcs_make(&scratch->contours, contour, params, &scratch->arcs);
    struct arc arc;
    app_write_key(write, "part");
    app_write_open(write, '[');
    for (int32_t i = 0; is_searched && i < head->nests.nest_count; i++) {
        const struct ih_nest *nest = &head->nests.nest[i];
        for (int32_t k = 0; k < nest->slice_count; k++) {
            const struct ih_slice *slice = &nest->slice[k];
            if (!slice->whole &&
                nest->front_mm_q8 + slice->behind_mm_q8 == scratch->contours.level_mm_q8 &&
                ih_box_holds(&box, nest->minimum) && find_arc(scratch, nest, slice, params, &arc)) {
                app_write_open(write, '{');
                app_write_int_field(write, "nest", i);
                app_write_int_field(write, "slice", k);
                write_vertices(write, arc.vertex, arc.vertex_count);
                app_write_close(write, '}');
            }
        }
    }
    app_write_close(write, ']');
}

static void write_contour(struct app_write *write, struct isohead *head,
                          const struct ih_contour *contour)
{
    app_write_open(write, '{');
    app_write_key(write, "closed");
    app_write_bool(write, contour->closed);
    write_vertices(write, &head->scratch.nests.contours.vertex[contour->first],
                   contour->vertex_count);
    write_arcs(write, head, contour);
    app_write_close(write, '}');
}

void sim_trace_contours(struct app_write *write, struct isohead *head)
{
    struct ih_contours *contours = &head->scratch.nests.contours;
    int32_t level_mm_q8 = 0;
    app_write_key(write, "cuts");
    app_write_open(write, '[');
    for (int32_t index = 0;
         head->surface.valid &&
         ih_nests_level(&head->surface, &head->params.nests, index, &level_mm_q8);
         index++) {
        ih_contours_level(&head->surface, level_mm_q8, contours);
        app_write_open(write, '{');
        app_write_int_field(write, "level_mm_q8", contours->level_mm_q8);
        app_write_int_field(write, "contours_dropped", contours->contours_dropped);
        app_write_key(write, "contour");
        app_write_open(write, '[');
        for (int32_t i = 0; i < contours->contour_count; i++) {
            write_contour(write, head, &contours->contour[i]);
        }
        app_write_close(write, ']');
        app_write_close(write, '}');
    }
    app_write_close(write, ']');
}
