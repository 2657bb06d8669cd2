#include "rd_view.h"

#include <stddef.h>

#include "rd_rng.h"

#define DRAWS_MAX 60
#define DOTS_MIN 120
#define HEAD_DOTS_MIN 8
#define CLOSEST_MM 350.0
#define FARTHEST_MM 2500.0
#define ASIDE_MM 600.0
/* A dot within this part of the semi-axes is on the head: hair, ears and the estimate's error are outside of 1. */
#define HEAD_SCALE 1.25
#define START_MM 1.0
#define SIGHT_SLACK_MM 0.5

/* What the camera stands before. */
struct subject {
    struct rd_vec position_mm;
    const struct rd_range_head *head; /* NULL: a thing */
    double yaw, pitch;                /* where the drawn angles start from */
};

static bool on_head(const struct rd_range_head *head, struct rd_vec point_mm)
{
    struct rd_vec away = rd_over(rd_sub(point_mm, head->centre_mm), head->semi_axes_mm);
    return rd_length(away) < HEAD_SCALE;
}

/* Whether one dot shows, and where in the depth camera's frame. */
static bool dot_shows(const struct rd_relief *relief, const struct rd_rig *rig, const struct rd_pose *camera, int index,
                      double *t_mm, struct rd_vec *position_mm)
{
    double u, v;
    struct rd_vec origin = rd_pose_out(camera, rig->projector_mm), dir = rd_turn(&camera->rot, rig->dot_rays[index]);
    *t_mm = rd_relief_hit(relief, origin, dir, START_MM, FARTHEST_MM);
    if (*t_mm < 0.0)
        return false;
    *position_mm = rd_along(origin, dir, *t_mm);
    struct rd_vec sight = rd_sub(*position_mm, camera->origin_mm);
    double length_mm = rd_length(sight);
    return rd_rig_project(rig, rd_pose_in(camera, *position_mm), &u, &v) && u >= 0.0 && v >= 0.0 &&
           u <= rig->width - 1.0 && v <= rig->height - 1.0 &&
           rd_relief_hit(relief, camera->origin_mm, rd_scale(sight, 1.0 / length_mm), START_MM,
                         length_mm - SIGHT_SLACK_MM) < 0.0;
}

static bool is_good(const struct rd_relief *relief, const struct rd_rig *rig, const struct rd_pose *camera,
                    const struct rd_range_head *head)
{
    int dot_count = 0, head_count = 0;
    struct rd_vec position_mm;
    /* In the way of the depth camera's sight there must still be room before the surface: else the camera stands
     * in a thing or behind it, where nothing is known. */
    if (rd_relief_at_point(relief, camera->origin_mm, &position_mm) && position_mm.z < camera->origin_mm.z + CLOSEST_MM)
        return false;
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        double t_mm;
        bool shows = dot_shows(relief, rig, camera, i, &t_mm, &position_mm);
        if (t_mm > 0.0 && t_mm < CLOSEST_MM)
            return false;
        dot_count += shows;
        head_count += shows && head != NULL && on_head(head, position_mm);
    }
    return dot_count >= DOTS_MIN && (head == NULL || head_count >= HEAD_DOTS_MIN);
}

/* Of two points of the surface the nearer one. */
static bool draw_thing(const struct rd_relief *relief, const struct rd_relief_camera *depth_camera, struct rd_rng *rng,
                       struct rd_vec *position_mm)
{
    bool found = false;
    for (int i = 0; i < 2; i++) {
        struct rd_vec position;
        double u = rd_rng_uniform(rng, 0.1, 0.9) * depth_camera->width;
        double v = rd_rng_uniform(rng, 0.1, 0.9) * depth_camera->height;
        if (rd_relief_at_pixel(relief, u, v, &position) && (!found || position.z < position_mm->z)) {
            *position_mm = position;
            found = true;
        }
    }
    return found;
}

static struct rd_pose draw_pose(const struct subject *subject, struct rd_rng *rng)
{
    bool person = subject->head != NULL;
    double side_deg = person ? 15.0 : 25.0, up_deg = person ? 10.0 : 15.0, roll_deg = person ? 4.0 : 5.0;
    double aim_deg = person ? 5.0 : 9.0;
    double yaw = subject->yaw + rd_rng_uniform(rng, -side_deg, side_deg) * RD_RAD_PER_DEG;
    double pitch = subject->pitch + rd_rng_uniform(rng, -up_deg, up_deg) * RD_RAD_PER_DEG;
    double roll = rd_rng_uniform(rng, -roll_deg, roll_deg) * RD_RAD_PER_DEG;
    double distance_mm = rd_rng_uniform(rng, person ? 600.0 : 500.0, 1400.0);
    double across = tan(rd_rng_uniform(rng, -aim_deg, aim_deg) * RD_RAD_PER_DEG);
    double down = tan(rd_rng_uniform(rng, -aim_deg, aim_deg) * RD_RAD_PER_DEG);
    struct rd_pose camera = {rd_rot_euler(yaw, pitch, roll), subject->position_mm};
    struct rd_vec sight = rd_turn(&camera.rot, rd_unit(rd_v(across, down, 1.0)));
    camera.origin_mm = rd_along(camera.origin_mm, sight, -distance_mm);
    return camera;
}

static bool draw_subject(const struct rd_relief *relief, const struct rd_range_frame *frame, struct rd_rng *rng,
                         struct subject *subject)
{
    *subject = (struct subject){.head = NULL};
    if (frame->head_count == 0)
        return draw_thing(relief, &frame->camera, rng, &subject->position_mm);
    subject->head = &frame->heads[rd_rng_pick(rng, frame->head_count)];
    subject->position_mm = subject->head->centre_mm;
    struct rd_vec offset = rd_unit(subject->position_mm);
    subject->yaw = atan2(offset.x, offset.z);
    subject->pitch = -asin(offset.y);
    return true;
}

struct rd_pose rd_view_draw(const struct rd_relief *relief, const struct rd_range_frame *frame,
                            const struct rd_rig *rig, uint64_t seed, uint64_t frame_index)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_MOTION + ((frame_index + 1) << 32));
    for (int draw = 0; seed != 0 && draw < DRAWS_MAX; draw++) {
        struct subject subject;
        if (!draw_subject(relief, frame, &rng, &subject))
            continue;
        struct rd_pose camera = draw_pose(&subject, &rng);
        bool aside = fabs(camera.origin_mm.x) > ASIDE_MM || fabs(camera.origin_mm.y) > ASIDE_MM;
        if ((subject.head != NULL || !aside) && is_good(relief, rig, &camera, subject.head))
            return camera;
    }
    return rd_pose_at(rd_v(0.0, 0.0, 0.0));
}
