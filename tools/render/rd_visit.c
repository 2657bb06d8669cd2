#include "rd_visit.h"

#include "rd_rng.h"

#define EDGE_OF_100 15
#define WALK_FRAMES 10
#define WALK_FRAMES_MORE 6
/* Two visits need this many frames; then the first is over in the first half. */
#define TWICE_FRAMES 100
/* Half of what the camera sees, as a tangent, and half a body with its arms. */
#define SIGHT_TANGENT 0.42
#define BODY_MM 420.0

static double draw_side(struct rd_rng *rng, const bool side_free[2])
{
    double side = rd_rng_sign(rng);
    return side_free[side > 0.0 ? 1 : 0] ? side : -side;
}

/* One visit within frames first .. end - 1. */
static struct rd_visit draw_visit(struct rd_rng *rng, int first, int end, const bool side_free[2])
{
    struct rd_visit visit = {.come_frame = first};
    int walk_max = (end - first) / 3;
    int come = WALK_FRAMES + rd_rng_pick(rng, WALK_FRAMES_MORE), go = WALK_FRAMES + rd_rng_pick(rng, WALK_FRAMES_MORE);
    come = come < walk_max ? come : walk_max;
    go = go < walk_max ? go : walk_max;
    int spare = (end - first - come - go) / 2;
    visit.come_frame += rd_rng_pick(rng, spare + 1);
    visit.sit_frame = visit.come_frame + come;
    visit.gone_frame = end - rd_rng_pick(rng, spare - (visit.come_frame - first) + 1);
    visit.rise_frame = visit.gone_frame - go;
    visit.come_side = draw_side(rng, side_free);
    visit.go_side = draw_side(rng, side_free);
    return visit;
}

void rd_visits_plan(struct rd_visits *visits, uint64_t seed, int frame_count, double distance_mm,
                    const bool side_free[2])
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_SCHEDULE);
    int edge = frame_count * EDGE_OF_100 / 100;
    int half = frame_count / 2;
    visits->count = frame_count >= TWICE_FRAMES && rd_rng_chance(&rng, 0.3) ? 2 : 1;
    visits->outside_mm = SIGHT_TANGENT * distance_mm + BODY_MM;
    visits->stand_mm = rd_rng_uniform(&rng, 20.0, 380.0);
    visits->before_mm = rd_rng_uniform(&rng, 40.0, 140.0);
    visits->facing = rd_rng_uniform(&rng, 0.6, 1.4);
    visits->visits[0] = draw_visit(&rng, edge, visits->count == 2 ? half : frame_count - edge, side_free);
    if (visits->count == 2)
        visits->visits[1] = draw_visit(&rng, half + edge / 3, frame_count - edge, side_free);
}

/* Part of the way: 0 out of sight, 1 on the seat. */
static struct rd_approach approach_at(const struct rd_visits *v, double part, double side, double facing)
{
    double away = 1.0 - rd_smoothstep(0.0, 0.85, part), sitting = rd_smoothstep(0.55, 1.0, part);
    double bend = sin(RD_PI * rd_clamp((part - 0.4) / 0.6, 0.0, 1.0));
    struct rd_approach approach = {
        .shift_mm = rd_v(side * v->outside_mm * away, -v->stand_mm * (1.0 - sitting), -v->before_mm * (1.0 - sitting)),
        .yaw = facing * v->facing * (1.0 - rd_smoothstep(0.35, 0.9, part)),
        .pitch = 0.28 * bend};
    return approach;
}

bool rd_visits_at(const struct rd_visits *visits, int frame, struct rd_approach *approach)
{
    *approach = (struct rd_approach){.yaw = 0.0};
    for (int i = 0; i < visits->count; i++) {
        const struct rd_visit *v = &visits->visits[i];
        if (frame < v->come_frame || frame >= v->gone_frame)
            continue;
        /* Who comes from +X looks to -X, and the other way round who leaves. */
        if (frame < v->sit_frame)
            *approach = approach_at(visits, (frame - v->come_frame + 0.5) / (v->sit_frame - v->come_frame),
                                    v->come_side, v->come_side);
        else if (frame >= v->rise_frame)
            *approach = approach_at(visits, (v->gone_frame - frame - 0.5) / (v->gone_frame - v->rise_frame), v->go_side,
                                    -v->go_side);
        return true;
    }
    return false;
}
