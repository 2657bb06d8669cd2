/* longrun FRAMES DIR... - many frames through the core in one process: at the end the same memory and
 * the same records for the same frames as at the start.
 *
 * Each frames directory, and the made-up scenes of a depth camera (golden_scene), has a state of its
 * own that is never started anew. All are played in turn, round after round, until FRAMES frames were
 * processed: people appear and vanish with every one of them.
 *
 * What a round gives must not depend on what was before it, nor on the clock: each has other times,
 * from the most negative to the last ones that 64 bits hold, and after the third round tracks have the
 * numbers before and after the largest. So every round's records, times and numbers of tracks counted
 * from its start, are compared with the first round's, and so are the hashes of the stages. At the end
 * each state is started anew and gives the first round's records as they are, to the byte. Where the rig is
 * is a mean over the frames before, so each round starts that one anew; the rigs are right and do not move.
 *
 * Exit status: 0 the same, 1 a difference or what cannot be read, 2 wrong usage.
 */
#include <inttypes.h>
#include <malloc.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app_record.h"
#include "app_rig.h"
#include "app_view.h"
#include "golden_hash.h"
#include "golden_scene.h"
#include "hal_file.h"
#include "replay/hal_replay.h"

/* What this process holds. */
struct memory {
    long long heap_bytes;  /* allocated and not freed */
    long long resident_kb; /* anonymous pages in RAM; -1 where a sanitizer keeps what was freed */
};

#ifdef __SANITIZE_ADDRESS__
/* The sanitizer's own count: mallinfo2 knows nothing of its heap. Not every compiler brings the header. */
size_t __sanitizer_get_current_allocated_bytes(void);

/* False, with a message on standard error: the system does not report it. */
static bool read_memory(struct memory *out)
{
    out->heap_bytes = (long long)__sanitizer_get_current_allocated_bytes();
    out->resident_kb = -1;
    return true;
}
#else
#define PAGES "/proc/self/smaps_rollup"

static bool resident_kb(long long *kb)
{
    char line[256];
    bool found = false;
    FILE *file = fopen(PAGES, "r");
    if (file == NULL) {
        perror("longrun: " PAGES);
        return false;
    }
    while (!found && fgets(line, sizeof line, file) != NULL) {
        found = sscanf(line, "Anonymous: %lld kB", kb) == 1;
    }
    fclose(file);
    if (!found) {
        fputs("longrun: " PAGES " has no line \"Anonymous: N kB\"\n", stderr);
    }
    return found;
}

static bool read_memory(struct memory *out)
{
    struct mallinfo2 info = mallinfo2();
    out->heap_bytes = (long long)(info.uordblks + info.hblkhd);
    return resident_kb(&out->resident_kb);
}
#endif

#define SEQUENCES_MAX 8
#define FRAMES_PER_SEQUENCE_MAX 200
#define SECOND_US 1000000
/* Memory is compared with what it was after so many rounds. */
#define WARM_ROUNDS 2
/* In this round the numbers of tracks come to their maximum. */
#define WRAP_ROUND 3
#define WRAP_IDS_LEFT 2
/* Hashes of the stages before the detections, which hold numbers of tracks. */
#define STAGES 9
#define REPORTED_MAX 5

/* What the first round gave. */
struct expected {
    uint64_t hash[STAGES];
    char *record;
    size_t length;
};

struct sequence {
    const char *dir; /* NULL: the depth camera's scenes */
    struct ih_calibration calibration;
    struct isohead head;
    struct ih_align align; /* as it was at first */
    int32_t frame_count;   /* of the first round */
    struct expected expected[FRAMES_PER_SEQUENCE_MAX];
    int64_t track_count; /* begun so far */
};

struct run {
    struct sequence sequence[SEQUENCES_MAX];
    int32_t sequence_count;
    int64_t round, frame_count, compared_count, different_count;
    bool failed; /* something could not be read */
};

/* One sequence, once. */
struct visit {
    struct run *run;
    struct sequence *sequence;
    int64_t start_us;
    int32_t last_id; /* of the tracks before it */
    int32_t index;   /* of the next frame */
};

static struct run run;
static struct app_record record;
static char output[BUFSIZ]; /* none that is allocated in between */

/* Rounds take their times from here in turn: before and behind 0, 2^31, 2^32 and 2^53 microseconds,
 * the first and the last that there are; none follows the one before it so closely that tracks go on. */
static int64_t start_of_round_us(int64_t round)
{
    static const int64_t start_us[] = {0,
                                       INT64_MIN,
                                       (INT64_C(1) << 31) - SECOND_US,
                                       INT64_MAX - INT64_C(60) * SECOND_US,
                                       -SECOND_US,
                                       (INT64_C(1) << 32) - SECOND_US,
                                       (INT64_C(1) << 53) - SECOND_US};
    return start_us[round % (int64_t)(sizeof start_us / sizeof start_us[0])];
}

static void fail(const char *subject, const char *text)
{
    fprintf(stderr, "longrun: %s: %s\n", subject, text);
    run.failed = true;
}

static void log_error(void *context, const char *subject, const char *text)
{
    (void)context;
    fail(subject, text);
}

/* Numbers of tracks counted from the visit's start; after the largest comes 1. */
static void count_tracks_from_start(const struct visit *visit, struct ih_result *result)
{
    for (int32_t i = 0; i < result->entry_count; i++) {
        int64_t id = result->entry[i].track_id;
        if (id != 0) {
            id -= visit->last_id;
            result->entry[i].track_id = (int32_t)(id > 0 ? id : id + INT32_MAX);
        }
    }
}

static void keep(struct visit *visit, const uint64_t hash[STAGES])
{
    if (visit->index == FRAMES_PER_SEQUENCE_MAX) {
        fail(visit->sequence->dir, "more frames than FRAMES_PER_SEQUENCE_MAX");
        return;
    }
    struct expected *expected = &visit->sequence->expected[visit->index];
    memcpy(expected->hash, hash, sizeof expected->hash);
    expected->length = record.length;
    expected->record = malloc(record.length);
    if (expected->record == NULL) {
        fail("a record", "no memory");
        return;
    }
    memcpy(expected->record, record.text, record.length);
    visit->sequence->frame_count = visit->index + 1;
}

static void report(const struct visit *visit, const struct expected *expected, const char *what)
{
    const char *dir = visit->sequence->dir;
    visit->run->different_count++;
    if (visit->run->different_count <= REPORTED_MAX) {
        printf("%s, frame %d, round %" PRId64
               ": another %s; the first round's record and this one:\n",
               dir != NULL ? dir : "depth camera", (int)visit->index, visit->run->round + 1, what);
        fwrite(expected->record, 1, expected->length, stdout);
        fwrite(record.text, 1, record.length, stdout);
    }
}

static void compare(const struct visit *visit, const uint64_t hash[STAGES])
{
    if (visit->index >= visit->sequence->frame_count) {
        fail(visit->sequence->dir, "more frames than in the first round");
        return;
    }
    const struct expected *expected = &visit->sequence->expected[visit->index];
    visit->run->compared_count++;
    if (expected->length != record.length ||
        memcmp(expected->record, record.text, record.length) != 0) {
        report(visit, expected, "record");
        return;
    }
    for (int32_t i = 0; i < STAGES; i++) {
        if (expected->hash[i] != hash[i]) {
            report(visit, expected, golden_stage[i].name);
            return;
        }
    }
}

/* A lit frame through the core; its record says the time since the visit's start. */
static void process(struct visit *visit, const struct hal_frame *frame,
                    const struct ih_frame *ambient)
{
    struct isohead *head = &visit->sequence->head;
    struct ih_frame view = app_view_of(frame);
    uint64_t hash[STAGES];
    enum ih_err err = isohead_frame(head, &view, ambient, visit->start_us + frame->time_us);
    if (err != IH_OK) {
        fail(frame->name, ih_err_text(err));
        return;
    }
    for (int32_t i = 0; i < STAGES; i++) {
        hash[i] = golden_stage[i].hash(head);
    }
    count_tracks_from_start(visit, &head->result);
    if (!app_record_frame(&record, frame, head, NULL)) {
        fail(frame->name, "its record is too long");
    } else if (visit->run->round == 0) {
        keep(visit, hash);
    } else {
        compare(visit, hash);
    }
    visit->run->frame_count++;
    visit->index++;
}

static void play_dir(struct visit *visit)
{
    const char *dir = visit->sequence->dir;
    const struct hal_log log = {NULL, log_error};
    struct hal_replay replay;
    struct hal_error error;
    struct hal_frame frame, dark = {.samples = NULL};
    struct ih_frame ambient;
    enum hal_next next;
    if (!hal_replay_open(&replay, dir, false, &log, &error)) {
        fail(dir, error.text);
        return;
    }
    const struct hal_camera *camera = &replay.camera;
    while ((next = camera->next(camera->context, &frame, &error)) == HAL_NEXT_FRAME) {
        if (frame.laser) {
            process(visit, &frame, dark.samples != NULL ? &ambient : NULL);
            camera->release(camera->context, &frame);
        } else {
            camera->release(camera->context, &dark);
            dark = frame;
            ambient = app_view_of(&frame);
        }
    }
    if (next == HAL_NEXT_BAD) {
        fail(dir, error.text);
    }
    camera->release(camera->context, &dark);
    hal_replay_close(&replay);
}

static void play_depth_camera(struct visit *visit)
{
    static uint16_t samples[GOLDEN_FRAME_BYTES / 2];
    for (int i = 0; i < GOLDEN_RANGE_SCENES; i++) {
        struct ih_frame view;
        const char *name = golden_scene_range(i, &visit->sequence->calibration, samples, &view);
        process(visit,
                &(struct hal_frame){.samples = view.samples,
                                    .width = view.width,
                                    .height = view.height,
                                    .stride_bytes = view.stride_bytes,
                                    .bytes_per_sample = view.bytes_per_sample,
                                    .maximum = view.maximum,
                                    .time_us = i * INT64_C(40000),
                                    .laser = true,
                                    .name = name},
                NULL);
    }
}

static void play(struct sequence *sequence)
{
    struct ih_tracks *tracks = &sequence->head.tracks;
    if (run.round == WRAP_ROUND) {
        tracks->last_id = INT32_MAX - WRAP_IDS_LEFT;
    }
    sequence->head.align = sequence->align;
    struct visit visit = {.run = &run,
                          .sequence = sequence,
                          .start_us = start_of_round_us(run.round),
                          .last_id = tracks->last_id};
    if (sequence->dir != NULL) {
        play_dir(&visit);
    } else {
        play_depth_camera(&visit);
    }
    if (run.round > 0 && visit.index < sequence->frame_count) {
        fail(sequence->dir, "fewer frames than in the first round");
    }
    int64_t begun = (int64_t)tracks->last_id - visit.last_id;
    sequence->track_count += begun < 0 ? begun + INT32_MAX : begun;
}

static void start(struct sequence *sequence)
{
    int32_t bad_slot = IH_NONE;
    enum ih_err err = isohead_init(&sequence->head, &sequence->calibration, &bad_slot);
    if (err != IH_OK) {
        fail(sequence->dir != NULL ? sequence->dir : "depth camera", ih_err_text(err));
    }
    sequence->align = sequence->head.align;
}

static void add_sequence(const char *dir)
{
    struct sequence *sequence = &run.sequence[run.sequence_count++];
    struct hal_error error;
    sequence->dir = dir;
    if (dir == NULL) {
        golden_scene_range_rig(&sequence->calibration);
    } else {
        char *path = hal_file_join(dir, "rig.json");
        if (path == NULL || !app_rig_load(path, &sequence->calibration, &error)) {
            fail(dir, path == NULL ? "no memory" : error.text);
        }
        free(path);
    }
    start(sequence);
}

static void play_round(bool anew)
{
    for (int32_t i = 0; i < run.sequence_count && !run.failed; i++) {
        if (anew) {
            start(&run.sequence[i]);
        }
        play(&run.sequence[i]);
    }
    run.round++;
}

static void print_table(const struct memory *first, const struct memory *last)
{
    int64_t tracks = 0;
    for (int32_t i = 0; i < run.sequence_count; i++) {
        tracks += run.sequence[i].track_count;
    }
    printf("%-34s %14s %14s\n", "", "start", "end");
    printf("%-34s %14lld %14lld\n", "heap, bytes", first->heap_bytes, last->heap_bytes);
    if (last->resident_kb >= 0) {
        printf("%-34s %14lld %14lld\n", "resident, kB", first->resident_kb, last->resident_kb);
    }
    printf("%-34s %14" PRId64 "\n", "frames", run.frame_count);
    printf("%-34s %14" PRId64 "\n", "rounds", run.round);
    printf("%-34s %14" PRId64 "\n", "tracks begun", tracks);
    printf("%-34s %14" PRId64 "\n", "records compared with round 1", run.compared_count);
    printf("%-34s %14" PRId64 "\n", "different", run.different_count);
}

/* Start: after WARM_ROUNDS. False: something differs. */
static bool play_all(int64_t frame_count)
{
    struct memory first = {0, 0}, last = {0, 0};
    while (!run.failed && (run.frame_count < frame_count || run.round <= WRAP_ROUND)) {
        play_round(false);
        run.failed |= !read_memory(run.round <= WARM_ROUNDS ? &first : &last);
    }
    play_round(true);
    run.failed |= !read_memory(&last);
    if (run.failed) {
        return false;
    }
    print_table(&first, &last);
    bool grown = last.heap_bytes != first.heap_bytes || last.resident_kb > first.resident_kb;
    if (grown) {
        fputs("longrun: the memory is NOT the same at the end as at the start\n", stderr);
    }
    if (run.different_count > 0) {
        fputs("longrun: NOT the same records for the same frames\n", stderr);
    }
    return !grown && run.different_count == 0;
}

int main(int argument_count, char **arguments)
{
    char *end = NULL;
    long long frame_count = argument_count > 1 ? strtoll(arguments[1], &end, 10) : 0;
    if (argument_count < 3 || argument_count > SEQUENCES_MAX + 1 || *end != 0 || frame_count < 1) {
        fprintf(stderr, "usage: longrun FRAMES DIR... (at most %d)\n", SEQUENCES_MAX - 1);
        return 2;
    }
    setvbuf(stdout, output, _IOFBF, sizeof output);
    for (int i = 2; i < argument_count; i++) {
        add_sequence(arguments[i]);
    }
    add_sequence(NULL);
    bool same = !run.failed && play_all(frame_count);
    for (int32_t i = 0; i < run.sequence_count; i++) {
        for (int32_t k = 0; k < run.sequence[i].frame_count; k++) {
            free(run.sequence[i].expected[k].record);
        }
    }
    return same ? 0 : 1;
}
