/* rd_vec - vectors, rotations and poses.
 * Axes as in the camera frame: X right, Y down, Z forward. A rotation is kept as its three local axes seen
 * from outside, so turning a vector is a sum and turning it back is three dot products.
 * Lengths are mm and angles radians unless a name says otherwise.
 */
#ifndef RD_VEC_H
#define RD_VEC_H

#include <math.h>

#define RD_PI 3.14159265358979323846
#define RD_RAD_PER_DEG (RD_PI / 180.0)

struct rd_vec {
    double x, y, z;
};

struct rd_rot {
    struct rd_vec x, y, z; /* the local axes in outer coordinates, orthonormal */
};

struct rd_pose {
    struct rd_rot rot;
    struct rd_vec origin_mm;
};

static inline struct rd_vec rd_v(double x, double y, double z)
{
    return (struct rd_vec){x, y, z};
}

static inline struct rd_vec rd_add(struct rd_vec a, struct rd_vec b)
{
    return rd_v(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline struct rd_vec rd_sub(struct rd_vec a, struct rd_vec b)
{
    return rd_v(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline struct rd_vec rd_scale(struct rd_vec a, double s)
{
    return rd_v(a.x * s, a.y * s, a.z * s);
}

/* a + b * s */
static inline struct rd_vec rd_along(struct rd_vec a, struct rd_vec b, double s)
{
    return rd_v(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

/* By component: a / b. */
static inline struct rd_vec rd_over(struct rd_vec a, struct rd_vec b)
{
    return rd_v(a.x / b.x, a.y / b.y, a.z / b.z);
}

static inline double rd_dot(struct rd_vec a, struct rd_vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct rd_vec rd_cross(struct rd_vec a, struct rd_vec b)
{
    return rd_v(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline double rd_length(struct rd_vec a)
{
    return sqrt(rd_dot(a, a));
}

/* The zero vector stays zero. */
static inline struct rd_vec rd_unit(struct rd_vec a)
{
    double length = rd_length(a);
    return length > 0.0 ? rd_scale(a, 1.0 / length) : a;
}

static inline double rd_clamp(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

/* 0 up to `from`, 1 beyond `to`, smooth between. */
static inline double rd_smoothstep(double from, double to, double value)
{
    double s = rd_clamp((value - from) / (to - from), 0.0, 1.0);
    return s * s * (3.0 - 2.0 * s);
}

static inline struct rd_vec rd_turn(const struct rd_rot *rot, struct rd_vec local)
{
    return rd_v(rot->x.x * local.x + rot->y.x * local.y + rot->z.x * local.z,
                rot->x.y * local.x + rot->y.y * local.y + rot->z.y * local.z,
                rot->x.z * local.x + rot->y.z * local.y + rot->z.z * local.z);
}

static inline struct rd_vec rd_turn_back(const struct rd_rot *rot, struct rd_vec outer)
{
    return rd_v(rd_dot(rot->x, outer), rd_dot(rot->y, outer), rd_dot(rot->z, outer));
}

/* First b, then a. */
static inline struct rd_rot rd_rot_mul(const struct rd_rot *a, const struct rd_rot *b)
{
    return (struct rd_rot){rd_turn(a, b->x), rd_turn(a, b->y), rd_turn(a, b->z)};
}

static inline struct rd_rot rd_rot_none(void)
{
    return (struct rd_rot){{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
}

/* Roll about Z first, then pitch about X, then yaw about Y. */
static inline struct rd_rot rd_rot_euler(double yaw_rad, double pitch_rad, double roll_rad)
{
    double cy = cos(yaw_rad), sy = sin(yaw_rad);
    double cp = cos(pitch_rad), sp = sin(pitch_rad);
    double cr = cos(roll_rad), sr = sin(roll_rad);
    struct rd_rot yaw = {{cy, 0.0, -sy}, {0.0, 1.0, 0.0}, {sy, 0.0, cy}};
    struct rd_rot pitch = {{1.0, 0.0, 0.0}, {0.0, cp, sp}, {0.0, -sp, cp}};
    struct rd_rot roll = {{cr, sr, 0.0}, {-sr, cr, 0.0}, {0.0, 0.0, 1.0}};
    struct rd_rot tilt = rd_rot_mul(&pitch, &roll);
    return rd_rot_mul(&yaw, &tilt);
}

/* A rotation whose Y axis is `y` (unit) and whose Z axis is as near to `z_hint` as that allows. */
static inline struct rd_rot rd_rot_frame(struct rd_vec y, struct rd_vec z_hint)
{
    struct rd_vec x = rd_cross(y, z_hint);
    if (rd_length(x) < 1e-9)
        x = rd_cross(y, fabs(y.x) < 0.9 ? rd_v(1.0, 0.0, 0.0) : rd_v(0.0, 0.0, 1.0));
    x = rd_unit(x);
    return (struct rd_rot){x, y, rd_cross(x, y)};
}

static inline struct rd_pose rd_pose_at(struct rd_vec origin_mm)
{
    return (struct rd_pose){rd_rot_none(), origin_mm};
}

static inline struct rd_vec rd_pose_out(const struct rd_pose *pose, struct rd_vec local)
{
    return rd_add(pose->origin_mm, rd_turn(&pose->rot, local));
}

static inline struct rd_vec rd_pose_in(const struct rd_pose *pose, struct rd_vec outer)
{
    return rd_turn_back(&pose->rot, rd_sub(outer, pose->origin_mm));
}

/* The outer frame's pose as it is seen from inside. */
static inline struct rd_pose rd_pose_inverse(const struct rd_pose *pose)
{
    const struct rd_rot *r = &pose->rot;
    struct rd_rot back = {{r->x.x, r->y.x, r->z.x}, {r->x.y, r->y.y, r->z.y}, {r->x.z, r->y.z, r->z.z}};
    return (struct rd_pose){back, rd_scale(rd_turn_back(r, pose->origin_mm), -1.0)};
}

/* The pose of something that stands in `inner` with respect to `outer`. */
static inline struct rd_pose rd_pose_mul(const struct rd_pose *outer, const struct rd_pose *inner)
{
    return (struct rd_pose){rd_rot_mul(&outer->rot, &inner->rot), rd_pose_out(outer, inner->origin_mm)};
}

#endif
