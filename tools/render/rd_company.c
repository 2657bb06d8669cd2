#include "rd_company.h"

/* Frames without the person, of fifty. */
#define EMPTY_OF_50 4
/* Dots from the pattern's middle to where a coming head is counted. */
#define VISIT_DOTS 8.0
/* Who sits is the one to find wherever that is. */
#define ANYWHERE_DOTS 1e3
/* Added to the seed for the second of two. */
#define SECOND_SEED 0x2545f4914f6cdd1du
#define ASIDE_MM 1000.0

static bool sits(const struct rd_options *options)
{
    return options->scene == RD_SCENE_PERSON || options->scene == RD_SCENE_TURNING || options->scene == RD_SCENE_TWO;
}

static void plan_absence(struct rd_company *company, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->seed, RD_STREAM_SCHEDULE);
    int frame_count = options->frame_count;
    int empty_count = (frame_count * EMPTY_OF_50 + 25) / 50;
    int position = rd_rng_pick(&rng, 3);
    int first = position == 0 ? 0 : position == 1 ? frame_count / 2 : frame_count - empty_count;
    company->empty_first = first;
    company->empty_end = first + empty_count;
    if (!sits(options)) {
        company->empty_first = 0;
        company->empty_end = frame_count;
    }
}

static struct rd_vec draw_head_place(struct rd_rng *rng, bool far_off)
{
    struct rd_vec at;
    at.x = rd_rng_uniform(rng, -45.0, 45.0);
    at.y = rd_rng_uniform(rng, -80.0, 0.0);
    at.z = far_off ? rd_rng_uniform(rng, 850.0, 1250.0) : rd_rng_uniform(rng, 730.0, 1060.0);
    return at;
}

static enum rd_background background_of(const struct rd_options *options, struct rd_rng *rng)
{
    double drawn = rd_rng_uniform(rng, 0.0, 1.0);
    if (options->background != RD_BACK_VARIED)
        return options->background;
    /* Who turns on an office chair mostly sits in the open. */
    if (options->scene == RD_SCENE_TURNING)
        drawn = 0.3 + 0.7 * drawn;
    return drawn < 0.45 ? RD_BACK_NEAR : drawn < 0.75 ? RD_BACK_FAR : RD_BACK_NONE;
}

/* One can come from where no wall stands. */
static void plan_visits(struct rd_company *company, const struct rd_options *options, const struct rd_scene *scene,
                        struct rd_vec head_mm)
{
    bool side_free[2];
    for (int i = 0; i < 2; i++) {
        struct rd_vec aside = rd_v(i == 0 ? -ASIDE_MM : ASIDE_MM, 0.0, 0.0);
        side_free[i] = !rd_scene_blocked(scene, head_mm, rd_add(head_mm, aside));
    }
    rd_visits_plan(&company->visits, options->seed, options->frame_count, head_mm.z, side_free);
}

static void add_visited_seat(struct rd_company *company, struct rd_scene *scene, struct rd_rng *rng,
                             struct rd_vec head_mm)
{
    const struct rd_sitter *visitor = &company->sitters[0];
    int kind = rd_rng_pick(rng, 3);
    double turn = rd_rng_uniform(rng, -0.3, 0.3);
    if (kind == 0) {
        rd_seat_build(scene, rng, head_mm);
    } else if (kind == 1) {
        rd_chair_make(&company->chair, scene, rng);
        rd_chair_build(&company->chair, scene, visitor->motion.hips_mm, turn, visitor->person.torso_mm);
    }
}

static void make_sitter(struct rd_company *company, const struct rd_options *options, uint64_t seed,
                        struct rd_rng *person_rng, struct rd_vec head_mm, struct rd_scene *scene)
{
    struct rd_sitter *sitter = &company->sitters[company->sitter_count++];
    struct rd_rng kind_rng = rd_rng_start(seed, RD_STREAM_PERSON + ((uint64_t)1 << 32));
    rd_person_make(&sitter->person, person_rng);
    rd_person_make_kind(&sitter->person, options->person, &kind_rng);
    rd_person_dress(&sitter->person, scene, person_rng);
    rd_gear_dress(&sitter->person, scene, &kind_rng);
    struct rd_vec lower_mm = rd_v(0.0, sitter->person.lower_mm, 0.0);
    rd_motion_make(&sitter->motion, &sitter->person, options, seed, rd_add(head_mm, lower_mm));
}

/* The second of two and their seat. */
static void make_neighbour(struct rd_company *company, const struct rd_options *options, struct rd_rng *seat_rng,
                           struct rd_vec head_mm, struct rd_scene *scene)
{
    uint64_t seed = options->seed + SECOND_SEED;
    struct rd_rng person_rng = rd_rng_start(seed, RD_STREAM_PERSON);
    make_sitter(company, options, seed, &person_rng, head_mm, scene);
    rd_seat_build(scene, seat_rng, head_mm);
}

/* Draws the first one's position beside the middle and returns the offset from there to the second. */
static struct rd_vec draw_neighbour(uint64_t seed, struct rd_vec *first_mm)
{
    struct rd_rng rng = rd_rng_start(seed + SECOND_SEED, RD_STREAM_SEAT);
    double apart_mm = rd_rng_uniform(&rng, 450.0, 650.0), behind_mm = fmax(0.0, rd_rng_uniform(&rng, -100.0, 200.0));
    double side = rd_rng_sign(&rng), up_mm = rd_rng_uniform(&rng, -50.0, 50.0);
    first_mm->x -= side * rd_rng_uniform(&rng, 0.1, 0.6) * apart_mm;
    first_mm->z += rd_rng_uniform(&rng, 50.0, 200.0);
    return rd_v(side * sqrt(apart_mm * apart_mm - behind_mm * behind_mm), up_mm, behind_mm);
}

/* A camera that looks up sees what is below the head nearer than the head; then everything moves away. */
static void plan_shift(struct rd_company *company, const struct rd_options *options, struct rd_vec head_mm)
{
    company->shifted = options->tilt_deg != 0.0 || options->away_mm != 0.0;
    company->shift.rot = rd_rot_euler(0.0, -options->tilt_deg * RD_RAD_PER_DEG, 0.0);
    company->shift.origin_mm = rd_sub(head_mm, rd_turn(&company->shift.rot, head_mm));
    company->shift.origin_mm.z += options->away_mm;
}

void rd_company_make(struct rd_company *company, const struct rd_options *options, const struct rd_rig *rig,
                     struct rd_scene *scene)
{
    bool turning = options->scene == RD_SCENE_TURNING, visit = options->scene == RD_SCENE_VISIT;
    bool two = options->scene == RD_SCENE_TWO;
    struct rd_rng person_rng = rd_rng_start(options->seed, RD_STREAM_PERSON);
    struct rd_rng room_rng = rd_rng_start(options->seed, RD_STREAM_ROOM);
    struct rd_rng seat_rng = rd_rng_start(options->seed, RD_STREAM_SEAT);
    struct rd_vec head_mm = draw_head_place(&person_rng, turning || visit || two), beside_mm = {0.0, 0.0, 0.0};
    company->kind = options->scene;
    company->rig = rig;
    company->sitter_count = 0;
    plan_absence(company, options);
    if (two)
        beside_mm = draw_neighbour(options->seed, &head_mm);
    make_sitter(company, options, options->seed, &person_rng, head_mm, scene);
    rd_room_build(scene, &room_rng, background_of(options, &room_rng), head_mm.z + beside_mm.z + 350.0);
    if (visit)
        plan_visits(company, options, scene, head_mm);
    if (turning)
        rd_chair_make(&company->chair, scene, &seat_rng);
    else if (visit)
        add_visited_seat(company, scene, &seat_rng, head_mm);
    else
        rd_seat_build(scene, &seat_rng, head_mm);
    if (two)
        make_neighbour(company, options, &seat_rng, rd_add(head_mm, beside_mm), scene);
    plan_shift(company, options, head_mm);
    if (company->shifted)
        rd_scene_move(scene, 0, &company->shift);
}

static void add_truth(struct rd_truth *truth, const struct rd_person *person, const struct rd_pose *head)
{
    const struct rd_rot *rot = &head->rot;
    truth->heads[truth->head_count++] = (struct rd_head_truth){
        .centre_mm = head->origin_mm,
        .semi_axes_mm = person->head_axes_mm,
        .angles_known = true,
        /* Yaw, pitch and roll of rd_rot_euler, read back from the axes. */
        .yaw_deg = atan2(rot->z.x, rot->z.z) / RD_RAD_PER_DEG,
        .pitch_deg = asin(rd_clamp(-rot->z.y, -1.0, 1.0)) / RD_RAD_PER_DEG,
        .roll_deg = atan2(rot->x.y, rot->y.y) / RD_RAD_PER_DEG,
    };
}

void rd_company_choose(struct rd_truth *truth, const struct rd_rig *rig, double dots)
{
    double min = 1e9;
    truth->head = RD_NOBODY;
    for (int i = 0; i < truth->head_count; i++) {
        struct rd_vec centre_mm = truth->heads[i].centre_mm;
        double row, column, away_mm = rd_length(centre_mm);
        bool ahead = rd_rig_pattern_place(rig, centre_mm, &row, &column);
        if (!ahead || fmax(fabs(row), fabs(column)) > dots || away_mm >= min)
            continue;
        min = away_mm;
        truth->head = i;
    }
}

/* An empty chair stays as it was left, or as it will be found. */
static void add_chair(struct rd_company *company, int frame, bool somebody, struct rd_scene *scene)
{
    const struct rd_sitter *sitter = &company->sitters[0];
    if (!somebody)
        frame = company->empty_first > 0 ? company->empty_first - 1 : company->empty_end;
    double turn = rd_motion_turn(&sitter->motion, frame);
    rd_chair_build(&company->chair, scene, sitter->motion.hips_mm, turn, sitter->person.torso_mm);
}

static bool somebody_in(struct rd_company *company, int frame)
{
    if (company->kind == RD_SCENE_VISIT)
        return rd_visits_at(&company->visits, frame, &company->sitters[0].motion.approach);
    return frame < company->empty_first || frame >= company->empty_end;
}

void rd_company_frame(struct rd_company *company, int frame, struct rd_scene *scene, struct rd_truth *truth)
{
    bool somebody = somebody_in(company, frame);
    int first = scene->shape_count;
    *truth = (struct rd_truth){.head = RD_NOBODY, .several = company->sitter_count > 1};
    if (company->kind == RD_SCENE_TURNING)
        add_chair(company, frame, somebody, scene);
    for (int i = 0; somebody && i < company->sitter_count; i++) {
        const struct rd_sitter *sitter = &company->sitters[i];
        struct rd_posture posture;
        rd_motion_posture(&sitter->motion, &sitter->person, frame, &posture);
        rd_person_build(&sitter->person, &posture, scene);
        struct rd_pose head = company->shifted ? rd_pose_mul(&company->shift, &posture.head) : posture.head;
        add_truth(truth, &sitter->person, &head);
    }
    if (company->shifted)
        rd_scene_move(scene, first, &company->shift);
    rd_company_choose(truth, company->rig, company->kind == RD_SCENE_VISIT ? VISIT_DOTS : ANYWHERE_DOTS);
}
