#include "rd_hands.h"

/* Between one position and the next the hand swings forward, round the head. */
#define SWING_MM 70.0

enum gesture_kind {
    IN_LAP,
    ON_FACE,
    AT_CHEEK,
    ON_TOP,
    AT_CHIN,
    BESIDE,
    REACH,
    AT_CHEST,
    AT_BROW,
    AT_EYES,
    AT_EAR,
    KIND_COUNT
};

/* Whose frame the position is given in. */
enum gesture_frame { OF_HEAD, OF_TORSO };

struct position {
    enum gesture_frame frame;
    struct rd_vec at;      /* units of the head's semi-axes from the head's middle; X is outwards on the hand's side */
    struct rd_vec more_mm; /* added to that */
    struct rd_vec fingers, facing; /* not yet unit */
    double scatter_mm;
    double weight; /* how often */
};

static const struct position positions[KIND_COUNT] = {
    [IN_LAP] = {OF_TORSO, {0, 0, 0}, {120, 560, -260}, {-0.3, 0.1, -1}, {0, 1, 0}, 25.0, 0.38},
    [ON_FACE] = {OF_HEAD, {0.1, 0.15, -1}, {0, 0, -40}, {-0.5, -1, 0.1}, {0, 0, 1}, 28.0, 0.16},
    [AT_CHEEK] = {OF_HEAD, {1, 0.15, -0.2}, {28, 0, 0}, {-0.1, -1, 0.2}, {-1, 0, 0.2}, 16.0, 0.08},
    [ON_TOP] = {OF_HEAD, {0.4, -1, -0.2}, {0, -22, 0}, {-1, -0.3, 0.3}, {0, 1, 0.2}, 18.0, 0.05},
    [AT_CHIN] = {OF_HEAD, {0.1, 0.85, -0.9}, {0, 0, -32}, {-0.7, -0.8, 0}, {0, -0.2, 1}, 18.0, 0.07},
    [BESIDE] = {OF_TORSO, {1, 0.1, -0.6}, {95, 0, -60}, {-0.1, -1, 0}, {0, 0, -1}, 65.0, 0.11},
    [REACH] = {OF_TORSO, {0.3, 0.5, -1}, {40, 0, -190}, {-0.2, -0.5, -0.8}, {0, 0.6, -0.7}, 60.0, 0.06},
    [AT_CHEST] = {OF_TORSO, {0.4, 1.9, -1}, {20, 0, -60}, {-1, -0.3, 0}, {0, 0, 1}, 45.0, 0.04},
    [AT_BROW] = {OF_HEAD, {0.2, -0.45, -0.95}, {0, 0, -35}, {-1, -0.35, 0}, {0, 0.2, 1}, 18.0, 0.05},
    /* Only those whose act it is. */
    [AT_EYES] = {OF_HEAD, {0.36, -0.02, -1}, {0, 0, -34}, {-0.3, -1, 0.1}, {0, 0, 1}, 12.0, 0.0},
    [AT_EAR] = {OF_HEAD, {1, 0.15, -0.1}, {36, 0, 0}, {-0.05, -1, 0.15}, {-1, 0, 0.1}, 8.0, 0.0},
};

static int draw_kind(struct rd_rng *rng)
{
    double left = rd_rng_uniform(rng, 0.0, 1.0);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        left -= positions[kind].weight;
        if (left < 0.0)
            return kind;
    }
    return IN_LAP;
}

static struct rd_gesture draw_gesture(struct rd_rng *rng, int kind)
{
    struct rd_gesture g = {.kind = kind};
    double scatter = positions[kind].scatter_mm;
    g.shift_mm.x = rd_rng_uniform(rng, -scatter, scatter);
    g.shift_mm.y = rd_rng_uniform(rng, -scatter, scatter);
    g.shift_mm.z = rd_rng_uniform(rng, -0.5 * scatter, 0.0);
    g.cross = kind != IN_LAP && rd_rng_chance(rng, 0.12);
    g.tilt = rd_rng_uniform(rng, -0.4, 0.4);
    g.curl = kind == AT_CHIN ? rd_rng_uniform(rng, 0.3, 1.0) : rd_rng_uniform(rng, 0.0, 0.35);
    g.spread = rd_rng_uniform(rng, 0.0, 1.0);
    return g;
}

static void plan_hand(struct rd_motion *motion, int index, struct rd_rng *rng)
{
    int count = 0;
    int frame = -rd_rng_pick(rng, 8);
    while (frame < motion->frame_count && count < RD_GESTURES_MAX) {
        int kind = draw_kind(rng);
        struct rd_gesture g = draw_gesture(rng, kind);
        g.arrive_frame = frame;
        g.leave_frame = frame + 1 + rd_rng_pick(rng, kind == IN_LAP ? 11 : 7);
        frame = g.leave_frame + 2 + rd_rng_pick(rng, 3);
        motion->gestures[index][count++] = g;
    }
    motion->gesture_count[index] = count;
}

/* What a hand does most of the time. */
struct habit {
    const int *kinds;
    int kind_count;
    double lap; /* how often it is in the lap instead */
    int stay_frames, stay_more;
};

static void plan_habit(struct rd_motion *motion, int index, struct rd_rng *rng, const struct habit *habit)
{
    int count = 0;
    int frame = -rd_rng_pick(rng, 8);
    while (frame < motion->frame_count && count < RD_GESTURES_MAX) {
        bool in_lap = rd_rng_chance(rng, habit->lap);
        int kind = in_lap ? IN_LAP : habit->kinds[rd_rng_pick(rng, habit->kind_count)];
        struct rd_gesture g = draw_gesture(rng, kind);
        g.cross = false;
        g.arrive_frame = frame;
        g.leave_frame = frame + 2 + (in_lap ? 0 : habit->stay_frames) + rd_rng_pick(rng, in_lap ? 4 : habit->stay_more);
        frame = g.leave_frame + 2 + rd_rng_pick(rng, 3);
        motion->gestures[index][count++] = g;
    }
    motion->gesture_count[index] = count;
}

static void plan_act(struct rd_motion *motion, uint64_t seed, enum rd_act act)
{
    static const int at_face[] = {ON_FACE, AT_CHIN, AT_CHEEK, AT_BROW, AT_EYES, AT_EYES};
    static const int at_ear[] = {AT_EAR};
    struct habit often = {at_face, 6, 0.12, 4, 14}, sometimes = {at_face, 6, 0.45, 4, 14};
    struct habit telephoning = {at_ear, 1, 0.15, 15, 25};
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_HANDS + ((uint64_t)1 << 32));
    int first = rd_rng_pick(&rng, 2);
    if (act == RD_ACT_PHONE) {
        plan_habit(motion, first, &rng, &telephoning);
        motion->phone[first] = true;
    } else if (act == RD_ACT_FACE) {
        plan_habit(motion, first, &rng, &often);
        plan_habit(motion, 1 - first, &rng, &sometimes);
    }
}

void rd_hands_plan(struct rd_motion *motion, uint64_t seed, enum rd_act act, bool hands_move)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_HANDS);
    for (int i = 0; i < 2; i++) {
        motion->gestures[i][0] = draw_gesture(&rng, IN_LAP);
        motion->gesture_count[i] = 1;
        motion->phone[i] = false;
        if (hands_move && act != RD_ACT_NONE)
            plan_hand(motion, i, &rng);
    }
    plan_act(motion, seed, act);
}

/* X of every position is outwards; `side` makes it this hand's side, or the other one for a crossing hand. */
static struct rd_vec on_side(struct rd_vec v, double side)
{
    return rd_v(side * v.x, v.y, v.z);
}

static struct rd_hand hand_at(const struct rd_gesture *g, const struct rd_person *person, double side,
                              const struct rd_posture *posture)
{
    const struct position *position = &positions[g->kind];
    struct rd_pose frame = posture->head;
    if (position->frame == OF_TORSO)
        frame.rot = posture->torso.rot;
    double towards = g->cross ? -0.6 * side : side;
    struct rd_vec axes = person->head_axes_mm;
    struct rd_vec at = rd_v(position->at.x * axes.x, position->at.y * axes.y, position->at.z * axes.z);
    at = rd_add(on_side(rd_add(at, position->more_mm), towards), g->shift_mm);
    struct rd_rot tilt = rd_rot_euler(0.0, 0.0, g->tilt);
    struct rd_vec fingers = rd_turn(&tilt, on_side(position->fingers, side));
    struct rd_hand hand = {.palm_mm = rd_pose_out(&frame, at),
                           .fingers = rd_unit(rd_turn(&frame.rot, fingers)),
                           .facing = rd_unit(rd_turn(&frame.rot, on_side(position->facing, side))),
                           .curl = g->curl,
                           .spread = g->spread};
    return hand;
}

static struct rd_hand blend(const struct rd_hand *a, const struct rd_hand *b, double part)
{
    double s = part * part * (3.0 - 2.0 * part);
    struct rd_hand hand = {
        .palm_mm = rd_add(rd_scale(a->palm_mm, 1.0 - s), rd_scale(b->palm_mm, s)),
        .fingers = rd_unit(rd_add(rd_scale(a->fingers, 1.0 - s), rd_scale(b->fingers, s))),
        .facing = rd_unit(rd_add(rd_scale(a->facing, 1.0 - s), rd_scale(b->facing, s))),
        .curl = a->curl * (1.0 - s) + b->curl * s,
        .spread = a->spread * (1.0 - s) + b->spread * s,
    };
    return hand;
}

static struct rd_hand hand_in_frame(const struct rd_motion *motion, const struct rd_person *person, int index,
                                    int frame, const struct rd_posture *posture)
{
    const struct rd_gesture *list = motion->gestures[index];
    double side = index == 0 ? -1.0 : 1.0;
    int now = 0;
    while (now + 1 < motion->gesture_count[index] && list[now + 1].arrive_frame <= frame)
        now++;
    struct rd_hand hand = hand_at(&list[now], person, side, posture);
    if (now + 1 < motion->gesture_count[index] && frame > list[now].leave_frame) {
        struct rd_hand next = hand_at(&list[now + 1], person, side, posture);
        double part = (double)(frame - list[now].leave_frame) / (list[now + 1].arrive_frame - list[now].leave_frame);
        hand = blend(&hand, &next, part);
        struct rd_vec forward = rd_scale(posture->torso.rot.z, -SWING_MM * sin(RD_PI * part));
        hand.palm_mm = rd_add(hand.palm_mm, forward);
    }
    return hand;
}

void rd_hands_pose(const struct rd_motion *motion, const struct rd_person *person, int frame,
                   struct rd_posture *posture)
{
    for (int i = 0; i < 2; i++) {
        posture->hands[i] = hand_in_frame(motion, person, i, frame, posture);
        posture->hands[i].phone = motion->phone[i];
    }
}
