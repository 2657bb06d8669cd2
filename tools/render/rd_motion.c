#include "rd_motion.h"

#include "rd_rng.h"

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

/* Fills the lists of gestures. Without `hands_move` both hands stay in the lap, but for what the act needs of them. */
static void plan_hands(struct rd_motion *motion, uint64_t seed, enum rd_act act, bool hands_move)
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

/* Sets posture->hands for a frame from the posture's head and torso. */
static void pose_hands(const struct rd_motion *motion, const struct rd_person *person, int frame,
                       struct rd_posture *posture)
{
    for (int i = 0; i < 2; i++) {
        posture->hands[i] = hand_in_frame(motion, person, i, frame, posture);
        posture->hands[i].phone = motion->phone[i];
    }
}

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
    plan_hands(motion, seed, options->act, options->sequence == 2);
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
    pose_hands(motion, person, frame, posture);
}

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
