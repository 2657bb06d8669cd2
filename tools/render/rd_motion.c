#include "rd_motion.h"

#include "rd_hands.h"
#include "rd_rng.h"

static struct rd_sway sway_of(struct rd_rng *rng, double middle_reach_deg, double low_deg, double high_deg)
{
    struct rd_sway sway;
    double reach = rd_rng_uniform(rng, low_deg, high_deg) * RD_RAD_PER_DEG;
    sway.middle = rd_rng_uniform(rng, -middle_reach_deg, middle_reach_deg) * RD_RAD_PER_DEG;
    sway.reach1 = 0.75 * reach;
    sway.reach2 = 0.25 * reach;
    sway.period1 = rd_rng_uniform(rng, 24.0, 60.0);
    sway.period2 = rd_rng_uniform(rng, 9.0, 20.0);
    sway.phase1 = rd_rng_uniform(rng, 0.0, 2.0 * RD_PI);
    sway.phase2 = rd_rng_uniform(rng, 0.0, 2.0 * RD_PI);
    return sway;
}

static double sway_at(const struct rd_sway *sway, int frame)
{
    return sway->middle + sway->reach1 * sin(2.0 * RD_PI * frame / sway->period1 + sway->phase1) +
           sway->reach2 * sin(2.0 * RD_PI * frame / sway->period2 + sway->phase2);
}

static struct rd_look_back draw_look_back(uint64_t seed, bool often)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_MOTION + ((uint64_t)1 << 32));
    struct rd_look_back back = {.often = often};
    back.offset = rd_rng_uniform(&rng, 4.0, 7.0);
    back.stay = rd_rng_uniform(&rng, 3.0, 10.0);
    back.period = 2.0 * back.offset + back.stay + rd_rng_uniform(&rng, 4.0, 14.0);
    back.start = rd_rng_uniform(&rng, 0.0, back.period);
    back.trunk = rd_rng_uniform(&rng, 40.0, 75.0) * RD_RAD_PER_DEG;
    back.head = rd_rng_uniform(&rng, 30.0, 60.0) * RD_RAD_PER_DEG;
    back.seed = rd_rng_next(&rng);
    return back;
}

/* -1 .. 1: how far to the back, and over which shoulder. */
static double look_back_at(const struct rd_look_back *back, int frame)
{
    double turns = (frame + back->start) / back->period, into = (turns - floor(turns)) * back->period;
    double side = rd_hash_unit(back->seed, (uint64_t)turns, 0) < 0.5 ? -1.0 : 1.0;
    double there = rd_smoothstep(0.0, back->offset, into);
    double returned = rd_smoothstep(back->offset + back->stay, 2.0 * back->offset + back->stay, into);
    return back->often ? side * (there - returned) : 0.0;
}

void rd_motion_make(struct rd_motion *motion, const struct rd_person *person, const struct rd_options *options,
                    uint64_t seed, struct rd_vec head_mm)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_MOTION);
    motion->lean = sway_of(&rng, 1.0, 2.0, 7.0);
    motion->bend = sway_of(&rng, 1.0, 2.0, 7.0);
    motion->twist = sway_of(&rng, 3.0, 3.0, 12.0);
    motion->yaw = sway_of(&rng, 8.0, 12.0, 50.0);
    motion->pitch = sway_of(&rng, 4.0, 4.0, 14.0);
    motion->roll = sway_of(&rng, 2.0, 3.0, 10.0);
    motion->approach = (struct rd_approach){.yaw = 0.0};
    motion->turning = options->scene == RD_SCENE_TURNING;
    motion->back = draw_look_back(seed, options->act == RD_ACT_BACK);
    motion->turn_start = rd_rng_uniform(&rng, -0.6, 0.6);
    motion->turn_total = rd_rng_sign(&rng) * 2.0 * RD_PI;
    motion->frame_count = options->frame_count;
    double up_mm = person->torso_mm + person->neck_length_mm + 0.80 * person->head_axes_mm.y;
    motion->hips_mm = rd_add(head_mm, rd_v(0.0, up_mm, 22.0));
    rd_hands_plan(motion, seed, options->act, options->sequence == 2);
}

double rd_motion_turn(const struct rd_motion *motion, int frame)
{
    if (!motion->turning)
        return 0.0;
    double part = (double)frame / (motion->frame_count > 1 ? motion->frame_count - 1 : 1);
    /* Unevenly: a seated person pushes the floor with the feet. */
    part += 0.04 * sin(6.0 * RD_PI * part);
    return motion->turn_start + motion->turn_total * part;
}

void rd_motion_posture(const struct rd_motion *motion, const struct rd_person *person, int frame,
                       struct rd_posture *posture)
{
    const struct rd_approach *approach = &motion->approach;
    double back = look_back_at(&motion->back, frame);
    double yaw = rd_motion_turn(motion, frame) + sway_at(&motion->twist, frame) + approach->yaw;
    yaw += back * motion->back.trunk;
    double pitch = sway_at(&motion->bend, frame) + approach->pitch;
    struct rd_rot lean = rd_rot_euler(yaw, pitch, sway_at(&motion->lean, frame));
    posture->torso = (struct rd_pose){lean, rd_add(motion->hips_mm, approach->shift_mm)};
    double head_yaw = sway_at(&motion->yaw, frame) + back * motion->back.head;
    posture->head = rd_person_head_pose(person, &posture->torso, head_yaw, sway_at(&motion->pitch, frame),
                                        sway_at(&motion->roll, frame));
    rd_hands_pose(motion, person, frame, posture);
}
