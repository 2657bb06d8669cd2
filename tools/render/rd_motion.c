#include "rd_motion.h"

#include "rd_hands.h"

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

void rd_motion_make(struct rd_motion *motion, const struct rd_person *person, uint64_t seed, int frame_count,
                    struct rd_vec head_mm, bool turning, bool hands_move)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_MOTION);
    motion->lean = sway_of(&rng, 1.0, 2.0, 7.0);
    motion->bend = sway_of(&rng, 1.0, 2.0, 7.0);
    motion->twist = sway_of(&rng, 3.0, 3.0, 12.0);
    motion->yaw = sway_of(&rng, 8.0, 12.0, 50.0);
    motion->pitch = sway_of(&rng, 4.0, 4.0, 14.0);
    motion->roll = sway_of(&rng, 2.0, 3.0, 10.0);
    motion->approach = (struct rd_approach){.yaw = 0.0};
    motion->turning = turning;
    motion->turn_start = rd_rng_uniform(&rng, -0.6, 0.6);
    motion->turn_total = rd_rng_sign(&rng) * 2.0 * RD_PI;
    motion->frame_count = frame_count;
    double up_mm = person->torso_mm + person->neck_length_mm + 0.80 * person->head_axes_mm.y;
    motion->hips_mm = rd_add(head_mm, rd_v(0.0, up_mm, 22.0));
    rd_hands_plan(motion, seed, hands_move);
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
    double yaw = rd_motion_turn(motion, frame) + sway_at(&motion->twist, frame) + approach->yaw;
    double pitch = sway_at(&motion->bend, frame) + approach->pitch;
    struct rd_rot lean = rd_rot_euler(yaw, pitch, sway_at(&motion->lean, frame));
    posture->torso = (struct rd_pose){lean, rd_add(motion->hips_mm, approach->shift_mm)};
    posture->head = rd_person_head_pose(person, &posture->torso, sway_at(&motion->yaw, frame),
                                        sway_at(&motion->pitch, frame), sway_at(&motion->roll, frame));
    rd_hands_pose(motion, person, frame, posture);
}
