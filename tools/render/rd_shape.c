#include "rd_shape.h"

#include <stdbool.h>

/* Nearer surfaces than this are the one the ray starts on. */
#define T_MIN_MM 1e-3
/* Steps and tolerance of the walk towards a rounded edge. */
#define BOX_STEPS_MAX 40
#define BOX_CLOSE_MM 0.02
/* No measured surface ends beyond this. */
#define RELIEF_REACH_MM 1e6

static struct rd_shape shape_of(enum rd_shape_kind kind, struct rd_pose pose, struct rd_vec half_mm, int material)
{
    struct rd_shape shape = {.kind = kind,
                             .material = material,
                             .pose = pose,
                             .half_mm = half_mm,
                             .clip_limit = 1.0,
                             .paint = pose,
                             .bound_centre_mm = pose.origin_mm,
                             .bound_radius_mm = rd_length(half_mm)};
    return shape;
}

struct rd_shape rd_shape_ellipsoid(struct rd_pose pose, struct rd_vec semi_axes_mm, int material)
{
    struct rd_shape shape = shape_of(RD_ELLIPSOID, pose, semi_axes_mm, material);
    shape.bound_radius_mm = fmax(semi_axes_mm.x, fmax(semi_axes_mm.y, semi_axes_mm.z));
    return shape;
}

struct rd_shape rd_shape_ball(struct rd_vec centre_mm, double radius_mm, int material)
{
    return rd_shape_ellipsoid(rd_pose_at(centre_mm), rd_v(radius_mm, radius_mm, radius_mm), material);
}

struct rd_shape rd_shape_cone(struct rd_vec a_mm, struct rd_vec b_mm, double a_radius_mm, double b_radius_mm,
                              int material)
{
    struct rd_vec ab = rd_sub(b_mm, a_mm);
    double length_mm = rd_length(ab);
    struct rd_vec y = length_mm > 0.0 ? rd_scale(ab, 1.0 / length_mm) : rd_v(0.0, 1.0, 0.0);
    struct rd_pose pose = {rd_rot_frame(y, rd_v(0.0, 0.0, 1.0)), a_mm};
    struct rd_shape shape = shape_of(RD_CONE, pose, rd_v(a_radius_mm, length_mm, b_radius_mm), material);
    shape.bound_centre_mm = rd_along(a_mm, ab, 0.5);
    shape.bound_radius_mm = 0.5 * length_mm + fmax(a_radius_mm, b_radius_mm);
    return shape;
}

struct rd_shape rd_shape_box(struct rd_pose pose, struct rd_vec half_mm, double round_mm, int material)
{
    struct rd_shape shape = shape_of(RD_BOX, pose, half_mm, material);
    shape.round_mm = fmin(round_mm, fmin(half_mm.x, fmin(half_mm.y, half_mm.z)));
    return shape;
}

struct rd_shape rd_shape_cylinder(struct rd_pose pose, double radius_mm, double half_height_mm, int material)
{
    return shape_of(RD_CYLINDER, pose, rd_v(radius_mm, half_height_mm, 0.0), material);
}

struct rd_shape rd_shape_frustum(struct rd_pose pose, double lower_radius_mm, double upper_radius_mm,
                                 double half_height_mm, int material)
{
    return shape_of(RD_FRUSTUM, pose, rd_v(lower_radius_mm, half_height_mm, upper_radius_mm), material);
}

struct rd_shape rd_shape_wall(struct rd_pose pose, double half_width_mm, double half_height_mm, int material)
{
    return shape_of(RD_WALL, pose, rd_v(half_width_mm, half_height_mm, 0.0), material);
}

struct rd_shape rd_shape_relief(struct rd_pose pose, const struct rd_relief *relief, int material)
{
    struct rd_shape shape = shape_of(RD_RELIEF, pose, rd_v(RELIEF_REACH_MM, 0.0, 0.0), material);
    shape.relief = relief;
    return shape;
}

void rd_shape_move(struct rd_shape *shape, const struct rd_pose *outer)
{
    shape->pose = rd_pose_mul(outer, &shape->pose);
    shape->paint = rd_pose_mul(outer, &shape->paint);
    shape->bound_centre_mm = rd_pose_out(outer, shape->bound_centre_mm);
}

static bool inside(double t, double t_max)
{
    return t > T_MIN_MM && t < t_max;
}

/* Both crossings count: through the opening of a bowl one sees its inside. */
static double hit_ellipsoid(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    o = rd_over(o, s->half_mm);
    d = rd_over(d, s->half_mm);
    double a = rd_dot(d, d), b = rd_dot(o, d), c = rd_dot(o, o) - 1.0;
    double root = b * b - a * c;
    if (root < 0.0)
        return RD_MISS;
    root = sqrt(root);
    for (int side = 0; side < 2; side++) {
        double t = (side == 0 ? -b - root : -b + root) / a;
        if (inside(t, t_max) && rd_dot(s->clip_normal, rd_along(o, d, t)) <= s->clip_limit)
            return t;
    }
    return RD_MISS;
}

/* The end balls touch the cone between them in two circles; `along` says on which part a point lies. */
static double hit_cone(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    double ra = s->half_mm.x, rb = s->half_mm.z, h = s->half_mm.y, dr = ra - rb;
    struct rd_vec ob = rd_v(o.x, o.y - h, o.z);
    double od = rd_dot(o, d), oo = rd_dot(o, o), obd = rd_dot(ob, d);
    double slope = h * h - dr * dr;
    double oy = h * o.y, dy = h * d.y;
    double k2 = slope - dy * dy;
    double k1 = slope * od - oy * dy + dy * dr * ra;
    double k0 = slope * oo - oy * oy + 2.0 * oy * dr * ra - h * h * ra * ra;
    double root = k1 * k1 - k0 * k2;
    if (slope > 0.0 && root >= 0.0 && fabs(k2) > 1e-12) {
        double t = (-sqrt(root) - k1) / k2;
        double along = oy - ra * dr + t * dy;
        if (along > 0.0 && along < slope)
            return inside(t, t_max) ? t : RD_MISS;
    }
    double best = RD_MISS;
    double root_a = od * od - oo + ra * ra;
    double root_b = obd * obd - rd_dot(ob, ob) + rb * rb;
    if (root_a >= 0.0 && inside(-od - sqrt(root_a), t_max))
        best = -od - sqrt(root_a);
    if (root_b >= 0.0 && inside(-obd - sqrt(root_b), best > 0.0 ? best : t_max))
        best = -obd - sqrt(root_b);
    return best;
}

/* How far a local point is outside the box's sharp core, by axis; positive components are outside. */
static struct rd_vec box_excess(const struct rd_shape *s, struct rd_vec p)
{
    double r = s->round_mm;
    return rd_v(fabs(p.x) - s->half_mm.x + r, fabs(p.y) - s->half_mm.y + r, fabs(p.z) - s->half_mm.z + r);
}

static double box_distance(const struct rd_shape *s, struct rd_vec p)
{
    struct rd_vec q = box_excess(s, p);
    struct rd_vec out = rd_v(fmax(q.x, 0.0), fmax(q.y, 0.0), fmax(q.z, 0.0));
    return rd_length(out) + fmin(fmax(q.x, fmax(q.y, q.z)), 0.0) - s->round_mm;
}

/* Narrows [t_in, t_out] to the slab |o + t d| <= half along one axis. */
static bool slab(double o, double d, double half, double *t_in, double *t_out)
{
    if (fabs(d) < 1e-12)
        return fabs(o) <= half;
    double t0 = (-half - o) / d, t1 = (half - o) / d;
    *t_in = fmax(*t_in, fmin(t0, t1));
    *t_out = fmin(*t_out, fmax(t0, t1));
    return *t_in <= *t_out;
}

/* The sharp box is met exactly; only near its edges a few steps lead on to the rounded surface. */
static double hit_box(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    double t = T_MIN_MM, t_out = t_max;
    if (!slab(o.x, d.x, s->half_mm.x, &t, &t_out) || !slab(o.y, d.y, s->half_mm.y, &t, &t_out) ||
        !slab(o.z, d.z, s->half_mm.z, &t, &t_out))
        return RD_MISS;
    for (int step = 0; step < BOX_STEPS_MAX && t < t_out; step++) {
        double distance = box_distance(s, rd_along(o, d, t));
        if (distance < BOX_CLOSE_MM)
            return t;
        t += distance;
    }
    return RD_MISS;
}

static double hit_cylinder(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    double r = s->half_mm.x, h = s->half_mm.y, best = RD_MISS;
    double a = d.x * d.x + d.z * d.z, b = o.x * d.x + o.z * d.z, c = o.x * o.x + o.z * o.z - r * r;
    double root = b * b - a * c;
    if (root < 0.0)
        return RD_MISS;
    if (a > 1e-12) {
        double t = (-b - sqrt(root)) / a;
        if (inside(t, t_max) && fabs(o.y + t * d.y) <= h)
            return t;
    }
    if (fabs(d.y) > 1e-12) {
        double t = ((d.y > 0.0 ? -h : h) - o.y) / d.y;
        double x = o.x + t * d.x, z = o.z + t * d.z;
        if (inside(t, t_max) && x * x + z * z <= r * r)
            best = t;
    }
    return best;
}

/* Change of the radius along Y. */
static double frustum_slope(const struct rd_shape *s)
{
    return 0.5 * (s->half_mm.x - s->half_mm.z) / s->half_mm.y;
}

/* Both crossings count, as with a bowl. */
static double hit_frustum(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    double slope = frustum_slope(s), r0 = s->half_mm.z + slope * (o.y + s->half_mm.y), r1 = slope * d.y;
    double a = d.x * d.x + d.z * d.z - r1 * r1, b = o.x * d.x + o.z * d.z - r0 * r1;
    double c = o.x * o.x + o.z * o.z - r0 * r0, root = b * b - a * c;
    if (root < 0.0 || fabs(a) < 1e-12)
        return RD_MISS;
    root = copysign(sqrt(root), a);
    for (int side = 0; side < 2; side++) {
        double t = (side == 0 ? -b - root : -b + root) / a;
        if (inside(t, t_max) && fabs(o.y + t * d.y) <= s->half_mm.y)
            return t;
    }
    return RD_MISS;
}

static double hit_wall(const struct rd_shape *s, struct rd_vec o, struct rd_vec d, double t_max)
{
    if (fabs(d.z) < 1e-12)
        return RD_MISS;
    double t = -o.z / d.z;
    bool on_it = fabs(o.x + t * d.x) <= s->half_mm.x && fabs(o.y + t * d.y) <= s->half_mm.y;
    return inside(t, t_max) && on_it ? t : RD_MISS;
}

double rd_shape_hit(const struct rd_shape *shape, const struct rd_ray *ray, double t_max_mm)
{
    struct rd_vec to_bound = rd_sub(shape->bound_centre_mm, ray->origin_mm);
    double along = rd_dot(to_bound, ray->dir), r = shape->bound_radius_mm;
    if (rd_dot(to_bound, to_bound) - along * along > r * r || along < -r || along - r > t_max_mm)
        return RD_MISS;
    struct rd_vec o = rd_pose_in(&shape->pose, ray->origin_mm);
    struct rd_vec d = rd_turn_back(&shape->pose.rot, ray->dir);
    switch (shape->kind) {
    case RD_ELLIPSOID:
        return hit_ellipsoid(shape, o, d, t_max_mm);
    case RD_CONE:
        return hit_cone(shape, o, d, t_max_mm);
    case RD_BOX:
        return hit_box(shape, o, d, t_max_mm);
    case RD_CYLINDER:
        return hit_cylinder(shape, o, d, t_max_mm);
    case RD_FRUSTUM:
        return hit_frustum(shape, o, d, t_max_mm);
    case RD_WALL:
        return hit_wall(shape, o, d, t_max_mm);
    case RD_RELIEF:
        return rd_relief_hit(shape->relief, o, d, T_MIN_MM, t_max_mm);
    }
    return RD_MISS;
}

static struct rd_vec cone_normal(const struct rd_shape *s, struct rd_vec p)
{
    double ra = s->half_mm.x, h = s->half_mm.y, dr = ra - s->half_mm.z;
    double slope = h * h - dr * dr;
    double along = h * p.y - ra * dr;
    if (along <= 0.0)
        return p;
    if (along >= slope)
        return rd_v(p.x, p.y - h, p.z);
    return rd_v(slope * p.x, slope * p.y - h * along, slope * p.z);
}

static struct rd_vec box_normal(const struct rd_shape *s, struct rd_vec p)
{
    struct rd_vec q = box_excess(s, p);
    double top = fmax(q.x, fmax(q.y, q.z));
    struct rd_vec n = rd_v(fmax(q.x, 0.0), fmax(q.y, 0.0), fmax(q.z, 0.0));
    if (top <= 0.0)
        n = rd_v(q.x == top ? 1.0 : 0.0, q.y == top ? 1.0 : 0.0, q.z == top ? 1.0 : 0.0);
    return rd_v(copysign(n.x, p.x), copysign(n.y, p.y), copysign(n.z, p.z));
}

struct rd_vec rd_shape_normal(const struct rd_shape *shape, struct rd_vec point_mm)
{
    struct rd_vec p = rd_pose_in(&shape->pose, point_mm), n = {0.0, 0.0, 0.0};
    switch (shape->kind) {
    case RD_ELLIPSOID:
        n = rd_over(rd_over(p, shape->half_mm), shape->half_mm);
        break;
    case RD_CONE:
        n = cone_normal(shape, p);
        break;
    case RD_BOX:
        n = box_normal(shape, p);
        break;
    case RD_CYLINDER:
        n = fabs(p.y) > shape->half_mm.y - 1e-6 ? rd_v(0.0, p.y, 0.0) : rd_v(p.x, 0.0, p.z);
        break;
    case RD_FRUSTUM:
        n = rd_v(p.x, -frustum_slope(shape) * hypot(p.x, p.z), p.z);
        break;
    case RD_WALL:
        n = rd_v(0.0, 0.0, -1.0);
        break;
    case RD_RELIEF:
        n = rd_relief_normal(shape->relief, p);
        break;
    }
    return rd_turn(&shape->pose.rot, rd_unit(n));
}
