#include "rd_relief.h"

#include <stdlib.h>

/* Largest step of inverse depth between joined pixels: a part of it (slant), and a part that is the same at every
 * distance (quantum of the sensor's disparity), 1/mm. */
#define JOIN_SLANT 0.012
#define JOIN_QUANTUM 4e-6
/* Neighbourhood of the plane fit. Its pixels may be this much farther off than joined ones. */
#define FIT_REACH_PX 4
#define FIT_STEPS 1.5
#define FIT_PIXELS_MIN 6
#define BLOCK_PX 8
/* Roundings must not let a ray slip between two triangles. */
#define SEAM 1e-9

/* Inverse depth (1/mm, 0: none) and its slopes per pixel; the cell right below has two triangles, one at this pixel
 * and one at the cell's opposite corner. */
struct sample {
    float w, w_u, w_v;
    bool joined, joined_opposite;
};

struct span {
    float low, high; /* low > high: empty */
};

struct rd_relief {
    struct rd_relief_camera camera;
    struct sample *samples;
    struct span *blocks;
    int block_columns, block_rows;
    double nearest_mm, farthest_mm;
};

/* A ray's part that may meet the surface, over the image: u, v and inverse depth are linear in s = 0 .. 1. */
struct path {
    double u, v, w, du, dv, dw;
    double t0_w0, t1_w1; /* distance along the ray times inverse depth, at both ends */
};

static bool close_enough(double w1, double w2, double steps)
{
    return fabs(w1 - w2) < steps * (JOIN_SLANT * fmax(w1, w2) + JOIN_QUANTUM);
}

static double inverse(uint16_t depth_mm)
{
    return depth_mm > 0 ? 1.0 / depth_mm : 0.0;
}

/* Least squares over a symmetric window, around its own means. */
static struct sample fit_plane(const struct rd_relief *r, const uint16_t *depth_mm, int u0, int v0)
{
    const struct sample none = {.w = 0.0f};
    int width = r->camera.width, height = r->camera.height;
    double middle = inverse(depth_mm[v0 * width + u0]);
    double n = 0.0, su = 0.0, sv = 0.0, sw = 0.0, suu = 0.0, svv = 0.0, suv = 0.0, suw = 0.0, svw = 0.0;
    for (int v = v0 - FIT_REACH_PX; middle > 0.0 && v <= v0 + FIT_REACH_PX; v++) {
        for (int u = u0 - FIT_REACH_PX; u <= u0 + FIT_REACH_PX; u++) {
            double w = u >= 0 && v >= 0 && u < width && v < height ? inverse(depth_mm[v * width + u]) : 0.0;
            if (w <= 0.0 || !close_enough(w, middle, FIT_STEPS))
                continue;
            double x = u - u0, y = v - v0, above = w - middle;
            n += 1.0;
            su += x;
            sv += y;
            sw += above;
            suu += x * x;
            svv += y * y;
            suv += x * y;
            suw += x * above;
            svw += y * above;
        }
    }
    if (n < FIT_PIXELS_MIN)
        return none;
    double mu = su / n, mv = sv / n, mw = sw / n;
    double cuu = suu / n - mu * mu, cvv = svv / n - mv * mv, cuv = suv / n - mu * mv;
    double cuw = suw / n - mu * mw, cvw = svw / n - mv * mw;
    double det = cuu * cvv - cuv * cuv;
    if (det < 0.05)
        return none; /* nearly in a line: no plane */
    double w_u = (cuw * cvv - cvw * cuv) / det, w_v = (cvw * cuu - cuw * cuv) / det;
    return (struct sample){.w = (float)(middle + mw - w_u * mu - w_v * mv), .w_u = (float)w_u, .w_v = (float)w_v};
}

static bool all_close(float a, float b, float c)
{
    double x = (double)a, y = (double)b, z = (double)c;
    return a > 0.0f && b > 0.0f && c > 0.0f && close_enough(x, y, 1.0) && close_enough(x, z, 1.0) &&
           close_enough(y, z, 1.0);
}

static void join_cells(struct rd_relief *r)
{
    int width = r->camera.width;
    for (int v = 0; v < r->camera.height - 1; v++) {
        for (int u = 0; u < width - 1; u++) {
            struct sample *row = &r->samples[v * width + u];
            const struct sample *next = row + width;
            row->joined = all_close(row[0].w, row[1].w, next[0].w);
            row->joined_opposite = all_close(next[1].w, row[1].w, next[0].w);
        }
    }
}

static void measure_block(struct rd_relief *r, int column, int row)
{
    struct span span = {1e9f, -1e9f};
    for (int v = row * BLOCK_PX; v <= (row + 1) * BLOCK_PX && v < r->camera.height; v++) {
        for (int u = column * BLOCK_PX; u <= (column + 1) * BLOCK_PX && u < r->camera.width; u++) {
            float w = r->samples[v * r->camera.width + u].w;
            if (w <= 0.0f)
                continue;
            span.low = w < span.low ? w : span.low;
            span.high = w > span.high ? w : span.high;
        }
    }
    r->blocks[row * r->block_columns + column] = span;
    if (span.low > span.high)
        return;
    r->nearest_mm = fmin(r->nearest_mm, 0.999 / (double)span.high);
    r->farthest_mm = fmax(r->farthest_mm, 1.001 / (double)span.low);
}

struct rd_relief *rd_relief_new(const struct rd_relief_camera *camera, const uint16_t *depth_mm)
{
    struct rd_relief *r = calloc(1, sizeof *r);
    if (r == NULL)
        return NULL;
    r->camera = *camera;
    r->nearest_mm = 1e9;
    r->block_columns = (camera->width + BLOCK_PX - 1) / BLOCK_PX;
    r->block_rows = (camera->height + BLOCK_PX - 1) / BLOCK_PX;
    r->samples = calloc((size_t)camera->width * (size_t)camera->height, sizeof *r->samples);
    r->blocks = malloc((size_t)r->block_columns * (size_t)r->block_rows * sizeof *r->blocks);
    if (r->samples == NULL || r->blocks == NULL) {
        rd_relief_free(r);
        return NULL;
    }
    for (int v = 0; v < camera->height; v++) {
        for (int u = 0; u < camera->width; u++)
            r->samples[v * camera->width + u] = fit_plane(r, depth_mm, u, v);
    }
    join_cells(r);
    for (int row = 0; row < r->block_rows; row++) {
        for (int column = 0; column < r->block_columns; column++)
            measure_block(r, column, row);
    }
    return r;
}

void rd_relief_free(struct rd_relief *relief)
{
    if (relief == NULL)
        return;
    free(relief->samples);
    free(relief->blocks);
    free(relief);
}

/* Narrows [s_in, s_out] to where low <= a + s d <= high. */
static bool clip(double a, double d, double low, double high, double *s_in, double *s_out)
{
    if (fabs(d) < 1e-12)
        return a >= low && a <= high;
    double s0 = (low - a) / d, s1 = (high - a) / d;
    *s_in = fmax(*s_in, fmin(s0, s1));
    *s_out = fmin(*s_out, fmax(s0, s1));
    return *s_in <= *s_out;
}

static void project(const struct rd_relief_camera *c, struct rd_vec p, double *u, double *v, double *w)
{
    *w = 1.0 / p.z;
    *u = c->fx_px * p.x * *w + c->cx_px;
    *v = c->fy_px * p.y * *w + c->cy_px;
}

/* The part of a ray within the surface's depths and the image. False: none. */
static bool find_path(const struct rd_relief *r, struct rd_vec o, struct rd_vec d, double t0, double t1,
                      struct path *path, double *s_in, double *s_out)
{
    double u1, v1, w1;
    if (!clip(o.z, d.z, r->nearest_mm, r->farthest_mm, &t0, &t1) || t0 >= t1)
        return false;
    project(&r->camera, rd_along(o, d, t0), &path->u, &path->v, &path->w);
    project(&r->camera, rd_along(o, d, t1), &u1, &v1, &w1);
    path->du = u1 - path->u;
    path->dv = v1 - path->v;
    path->dw = w1 - path->w;
    path->t0_w0 = t0 * path->w;
    path->t1_w1 = t1 * w1;
    *s_in = 0.0;
    *s_out = 1.0;
    return clip(path->u, path->du, 0.0, r->camera.width - 1.0, s_in, s_out) &&
           clip(path->v, path->dv, 0.0, r->camera.height - 1.0, s_in, s_out);
}

/* How far in front of (positive: nearer than) the triangle's plane the path is at s. The triangle's right angle is at
 * (u, v); its two other corners are one pixel from there, towards side. */
struct corner {
    double u, v, side;
    double w, w_across, w_down;
};

static double ahead_of(const struct corner *c, const struct path *path, double s)
{
    double x = c->side * (path->u + s * path->du - c->u), y = c->side * (path->v + s * path->dv - c->v);
    return path->w + s * path->dw - c->w - x * (c->w_across - c->w) - y * (c->w_down - c->w);
}

/* Where the path crosses a triangle between s_in and s_out, else a negative number. */
static double cross_triangle(const struct corner *c, const struct path *path, double s_in, double s_out)
{
    double before = ahead_of(c, path, s_in), after = ahead_of(c, path, s_out);
    if (before * after > 0.0 || before == after)
        return -1.0;
    double s = s_in + (s_out - s_in) * before / (before - after);
    double x = c->side * (path->u + s * path->du - c->u), y = c->side * (path->v + s * path->dv - c->v);
    return x + y <= 1.0 + SEAM ? s : -1.0;
}

static double cross_cell(const struct rd_relief *r, int u, int v, const struct path *path, double s_in, double s_out)
{
    const struct sample *row = &r->samples[v * r->camera.width + u], *next = row + r->camera.width;
    double across = (double)row[1].w, down = (double)next[0].w;
    struct corner upper = {u, v, 1.0, (double)row[0].w, across, down};
    struct corner lower = {u + 1.0, v + 1.0, -1.0, (double)next[1].w, down, across};
    double first = row[0].joined ? cross_triangle(&upper, path, s_in, s_out) : -1.0;
    double second = row[0].joined_opposite ? cross_triangle(&lower, path, s_in, s_out) : -1.0;
    return first < 0.0 ? second : second < 0.0 ? first : fmin(first, second);
}

static bool passes_block(const struct rd_relief *r, int column, int row, const struct path *path, double s_in,
                         double s_out)
{
    struct span span = r->blocks[row * r->block_columns + column];
    double w0 = path->w + s_in * path->dw, w1 = path->w + s_out * path->dw;
    return fmin(w0, w1) <= (double)span.high * (1.0 + SEAM) && fmax(w0, w1) >= (double)span.low * (1.0 - SEAM);
}

/* One axis of a walk over squares of size_px. */
struct axis {
    int index, step;
    double next_s, stride_s; /* s at the next border, and from border to border */
};

static struct axis start_axis(double at, double slope, double s_in, int size_px, int count)
{
    struct axis axis = {.step = slope > 0.0 ? 1 : -1, .next_s = 2.0, .stride_s = 0.0};
    axis.index = (int)rd_clamp(floor((at + s_in * slope) / size_px), 0.0, count - 1.0);
    if (fabs(slope) < 1e-12)
        return axis;
    int border = axis.index + (slope > 0.0 ? 1 : 0);
    axis.next_s = ((double)border * size_px - at) / slope;
    axis.stride_s = size_px / fabs(slope);
    return axis;
}

/* A walk over squares; the present one is crossed from s_in to s_next. */
struct walk {
    struct axis u, v;
    int columns, rows;
    double s_in, s_next, s_out;
};

/* False: the walk has ended. */
static bool enter(struct walk *walk)
{
    if (walk->u.index < 0 || walk->u.index >= walk->columns || walk->v.index < 0 || walk->v.index >= walk->rows)
        return false;
    walk->s_next = fmax(walk->s_in, fmin(walk->s_out, fmin(walk->u.next_s, walk->v.next_s)));
    return true;
}

static bool walk_start(struct walk *walk, const struct path *path, double s_in, double s_out, int size_px, int columns,
                       int rows)
{
    *walk = (struct walk){.u = start_axis(path->u, path->du, s_in, size_px, columns),
                          .v = start_axis(path->v, path->dv, s_in, size_px, rows),
                          .columns = columns,
                          .rows = rows,
                          .s_in = s_in,
                          .s_out = s_out};
    return s_in <= s_out && enter(walk);
}

static bool walk_on(struct walk *walk)
{
    struct axis *axis = walk->u.next_s < walk->v.next_s ? &walk->u : &walk->v;
    if (walk->s_next >= walk->s_out)
        return false;
    axis->index += axis->step;
    axis->next_s += axis->stride_s;
    walk->s_in = walk->s_next;
    return enter(walk);
}

static double cross_cells(const struct rd_relief *r, const struct path *path, double s_in, double s_out)
{
    struct walk walk;
    double found = -1.0;
    bool more = walk_start(&walk, path, s_in, s_out, 1, r->camera.width - 1, r->camera.height - 1);
    for (; more && found < 0.0; more = walk_on(&walk))
        found = cross_cell(r, walk.u.index, walk.v.index, path, walk.s_in, walk.s_next);
    return found;
}

static double cross_blocks(const struct rd_relief *r, const struct path *path, double s_in, double s_out)
{
    struct walk walk;
    double found = -1.0;
    bool more = walk_start(&walk, path, s_in, s_out, BLOCK_PX, r->block_columns, r->block_rows);
    for (; more && found < 0.0; more = walk_on(&walk)) {
        if (passes_block(r, walk.u.index, walk.v.index, path, walk.s_in, walk.s_next))
            found = cross_cells(r, path, walk.s_in, walk.s_next);
    }
    return found;
}

double rd_relief_hit(const struct rd_relief *relief, struct rd_vec origin_mm, struct rd_vec dir, double t_min_mm,
                     double t_max_mm)
{
    struct path path;
    double s_in, s_out;
    if (!find_path(relief, origin_mm, dir, t_min_mm, t_max_mm, &path, &s_in, &s_out))
        return -1.0;
    double s = cross_blocks(relief, &path, s_in, s_out);
    if (s < 0.0)
        return -1.0;
    /* Along a straight line distance times inverse depth is linear over the image, as inverse depth is. */
    return (path.t0_w0 + s * (path.t1_w1 - path.t0_w0)) / (path.w + s * path.dw);
}

struct rd_vec rd_relief_normal(const struct rd_relief *relief, struct rd_vec point_mm)
{
    const struct rd_relief_camera *c = &relief->camera;
    double u, v, w, sum = 0.0, w_u = 0.0, w_v = 0.0;
    project(c, point_mm, &u, &v, &w);
    int u0 = (int)rd_clamp(floor(u), 0.0, c->width - 2.0), v0 = (int)rd_clamp(floor(v), 0.0, c->height - 2.0);
    for (int i = 0; i < 4; i++) {
        const struct sample *sample = &relief->samples[(v0 + i / 2) * c->width + u0 + i % 2];
        double fraction = fmax(0.0, 1.0 - fabs(u0 + i % 2 - u)) * fmax(0.0, 1.0 - fabs(v0 + i / 2 - v));
        if (sample->w <= 0.0f || !close_enough((double)sample->w, w, FIT_STEPS))
            continue;
        sum += fraction;
        w_u += fraction * (double)sample->w_u;
        w_v += fraction * (double)sample->w_v;
    }
    if (sum <= 0.0)
        return rd_unit(rd_scale(point_mm, -1.0));
    w_u /= sum;
    w_v /= sum;
    /* The plane n . p = 1 through the point has inverse depth n.x (u - cx) / fx + n.y (v - cy) / fy + n.z. */
    struct rd_vec n = rd_v(w_u * c->fx_px, w_v * c->fy_px, w - w_u * (u - c->cx_px) - w_v * (v - c->cy_px));
    return rd_unit(rd_scale(n, -1.0));
}

bool rd_relief_at_pixel(const struct rd_relief *relief, double u_px, double v_px, struct rd_vec *position_mm)
{
    const struct rd_relief_camera *c = &relief->camera;
    int u = (int)floor(u_px + 0.5), v = (int)floor(v_px + 0.5);
    if (u < 0 || v < 0 || u >= c->width || v >= c->height || relief->samples[v * c->width + u].w <= 0.0f)
        return false;
    double z = 1.0 / (double)relief->samples[v * c->width + u].w;
    *position_mm = rd_v((u - c->cx_px) / c->fx_px * z, (v - c->cy_px) / c->fy_px * z, z);
    return true;
}

bool rd_relief_at_point(const struct rd_relief *relief, struct rd_vec point_mm, struct rd_vec *position_mm)
{
    double u, v, w;
    if (point_mm.z < 1.0)
        return false;
    project(&relief->camera, point_mm, &u, &v, &w);
    if (fabs(u) > 1e6 || fabs(v) > 1e6)
        return false;
    return rd_relief_at_pixel(relief, u, v, position_mm);
}
