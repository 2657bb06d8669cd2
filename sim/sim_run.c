#include "sim_run.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app_record.h"
#include "app_rig.h"
#include "app_view.h"
#include "hal_file.h"
#include "replay/hal_replay.h"
#include "sim_cloud.h"
#include "sim_dirs.h"
#include "sim_hint.h"
#include "sim_page.h"
#include "sim_report.h"
#include "sim_score.h"
#include "sim_table.h"
#include "sim_trace.h"
#include "sim_truth.h"
#include "sim_up.h"

#define STDOUT_NAME "standard output"
/* An ambient frame older than this says too little about the scene: at 1 m/s somebody has moved by
 * 200 mm. */
#define AMBIENT_AGE_MAX_US 200000

/* What a run works with. */
struct run {
    const struct sim_options *options;
    struct isohead *head;
    struct sim_report report;
    struct sim_dirs dirs;
    struct sim_score *score; /* one per directory */
    struct sim_page page;    /* its file is NULL when none is wanted */
    size_t done_count;       /* frames of the directories before this one */
};

/* One directory of it. */
struct visit {
    struct run *run;
    const struct sim_dir *dir;
    struct hal_replay replay;
    struct sim_truth truth;
    struct app_record record;
    struct sim_cloud cloud;
    struct sim_score *score;
    struct sim_hint hint;
    struct sim_up up;
    /* The last frame without laser, for the lit ones after it; samples NULL: none yet. */
    struct hal_frame ambient;
    struct ih_frame ambient_view;
    enum ih_align_state shown_state; /* on standard output */
};

/* Rig file to a core that is ready; wrong ones go to the report. */
static bool start_core(struct run *run, const char *dir, int32_t *scale_q20)
{
    struct ih_calibration calibration;
    struct hal_error error = {"no memory"};
    int32_t bad_slot = IH_NONE;
    char *own = hal_file_join(dir, "rig.json");
    const char *path = run->options->rig != NULL ? run->options->rig : own;
    bool good = path != NULL && app_rig_load_scaled(path, &calibration, scale_q20, &error);
    if (good) {
        enum ih_err err = isohead_init(run->head, &calibration, &bad_slot);
        if (run->options->paper) {
            ih_params_paper(&run->head->params);
        }
        sim_without_apply(run->options->without, &run->head->params);
        good = err == IH_OK;
        if (!good) {
            app_rig_explain(&calibration, err, bad_slot, &error);
        }
    }
    if (!good) {
        sim_report_error(&run->report, path != NULL ? path : dir, "%s", error.text);
    }
    free(own);
    return good;
}

static void report_frame(struct visit *visit, const char *name, const char *text)
{
    char *path = hal_file_join(visit->dir->path, name);
    sim_report_error(&visit->run->report, path != NULL ? path : name, "%s", text);
    free(path);
}

/* A record that is written, to standard output if it is wanted there: flushed, so that a reader at the other end of a pipe
 * has each at once. */
static void put_record(struct visit *visit, const char *name, bool fits)
{
    if (!fits) {
        struct hal_error error;
        hal_fail(&error, "its record has more than %d bytes", APP_RECORD_MAX);
        report_frame(visit, name, error.text);
        return;
    }
    if (!visit->run->options->json) {
        return;
    }
    fwrite(visit->record.text, 1, visit->record.length, stdout);
    fflush(stdout);
}

/* A frame that is lost. One without laser has no record, only a message. */
static void lose_frame(struct visit *visit, const struct hal_frame *frame, const char *text)
{
    report_frame(visit, frame->name, text);
    if (!frame->laser) {
        return;
    }
    struct run *run = visit->run;
    put_record(visit, frame->name, app_record_error(&visit->record, frame->name, text));
    if (run->page.file != NULL && visit->record.length > 0) {
        sim_page_lost(&run->page, &visit->record);
    }
    if (!run->options->json) {
        sim_table_error(stdout, frame->name, text);
    }
}

/* What else is wanted of a frame, in files. */
static void put_files(struct visit *visit, const struct sim_page_frame *frame)
{
    struct run *run = visit->run;
    const char *name = frame->frame->name;
    struct hal_error error = {""};
    if (run->options->trace != NULL) {
        const struct sim_trace trace = {run->options->trace, visit->dir->label,
                                        hal_replay_stem(&visit->replay, name)};
        if (!sim_trace_frame(&trace, frame->frame, frame->view, frame->head, &error)) {
            report_frame(visit, name, error.text);
        }
    }
    if (run->page.file != NULL && visit->record.length > 0 &&
        !sim_page_frame(&run->page, frame, &error)) {
        report_frame(visit, name, error.text);
    }
}

/* Results of one frame to where they are wanted. */
static void put_frame(struct visit *visit, const struct hal_frame *frame,
                      const struct ih_frame *view)
{
    const struct sim_options *options = visit->run->options;
    struct isohead *head = visit->run->head;
    const struct sim_truth_frame *truth = sim_truth_find(&visit->truth, frame->name);
    if (visit->truth.present && truth == NULL) {
        sim_truth_note_unknown(&visit->truth, frame->name);
    }
    struct sim_verdict verdict = sim_score_judge(&head->result, truth);
    sim_score_add(visit->score, &verdict);
    if (truth != NULL && truth->has_dots) {
        sim_score_add_dots(visit->score, head, truth);
    }
    put_record(visit, frame->name, app_record_frame(&visit->record, frame, head, NULL));
    if (!options->json) {
        sim_table_frame(stdout, frame, head, &verdict);
        if (head->align.now.state != visit->shown_state) {
            sim_table_rig(stdout, head);
            visit->shown_state = head->align.now.state;
        }
    }
    const struct sim_page_frame page_frame = {frame, view, head, &visit->record, truth, &verdict};
    put_files(visit, &page_frame);
}

static void release(struct visit *visit, const struct hal_frame *frame)
{
    const struct hal_camera *camera = &visit->replay.camera;
    camera->release(camera->context, frame);
}

/* A frame without laser is held until the next one. */
static void keep_ambient(struct visit *visit, const struct hal_frame *frame)
{
    const struct ih_calibration *rig = &visit->run->head->rig.calibration;
    struct hal_error error;
    if (frame->width != rig->width || frame->height != rig->height) {
        app_view_explain(frame, rig, IH_ERR_SIZE, &error);
        lose_frame(visit, frame, error.text);
        release(visit, frame);
        return;
    }
    release(visit, &visit->ambient);
    visit->ambient = *frame;
    visit->ambient_view = app_view_of(frame);
}

static const struct ih_frame *fresh_ambient(const struct visit *visit, int64_t time_us)
{
    bool fresh =
        visit->ambient.samples != NULL && time_us - visit->ambient.time_us <= AMBIENT_AGE_MAX_US;
    bool wanted = !sim_without_ambient(visit->run->options->without);
    return wanted && fresh ? &visit->ambient_view : NULL;
}

static void process_lit(struct visit *visit, const struct hal_frame *frame)
{
    struct isohead *head = visit->run->head;
    struct hal_error error;
    struct ih_frame view;
    if (!sim_cloud_view(&visit->cloud, frame, &head->rig, &view, &error)) {
        lose_frame(visit, frame, error.text);
        return;
    }
    enum ih_err err =
        isohead_frame(head, &view, fresh_ambient(visit, frame->time_us), frame->time_us);
    if (err != IH_OK) {
        app_view_explain(frame, &head->rig.calibration, err, &error);
        lose_frame(visit, frame, error.text);
        return;
    }
    sim_hint_frame(&visit->hint, head, &view);
    sim_up_frame(&visit->up, head, visit->replay.next_index - 1);
    put_frame(visit, frame, &view);
}

static void process_frame(struct visit *visit, const struct hal_frame *frame)
{
    if (frame->laser) {
        process_lit(visit, frame);
        release(visit, frame);
    } else {
        keep_ambient(visit, frame);
    }
}

static void process_frames(struct visit *visit)
{
    const struct hal_camera *camera = &visit->replay.camera;
    struct sim_report *report = &visit->run->report;
    struct hal_frame frame;
    struct hal_error error;
    enum hal_next next = HAL_NEXT_END;
    while (!ferror(stdout) &&
           (next = camera->next(camera->context, &frame, &error)) != HAL_NEXT_END) {
        if (next == HAL_NEXT_BAD) {
            lose_frame(visit, &frame, error.text);
        } else {
            process_frame(visit, &frame);
        }
        sim_report_progress(report, visit->dir->label,
                            visit->run->done_count + visit->replay.next_index,
                            visit->run->dirs.file_count);
    }
    sim_report_progress_end(report);
}

/* What is left out, and the paper's method alone, are meant to find less. */
static void report_hints(struct visit *visit)
{
    struct run *run = visit->run;
    const struct sim_options *options = run->options;
    const char *rig = options->rig != NULL ? options->rig : "its rig.json";
    const struct sim_up_source source = {&visit->replay, &visit->cloud, run->head, visit->dir->path,
                                         rig};
    sim_hint_report(&visit->hint, run->head, visit->dir->path, rig, &run->report);
    sim_hint_free(&visit->hint);
    if (!options->paper && options->without == 0) {
        sim_up_report(&visit->up, &source, &run->report);
    }
}

static void process_dir(struct run *run, size_t index)
{
    struct hal_error error;
    const struct sim_dir *dir = &run->dirs.dir[index];
    struct visit visit = {
        .run = run,
        .dir = dir,
        .record = {.dir = run->dirs.dir_count > 1 ? dir->path : NULL},
        .score = &run->score[index],
    };
    if (!start_core(run, dir->path, &visit.cloud.scale_q20)) {
        return;
    }
    visit.hint.scale_q20 = visit.cloud.scale_q20;
    struct hal_log log = sim_report_log(&run->report);
    bool with_lists = run->head->rig.calibration.kind == IH_RIG_RANGE;
    sim_hint_unread(dir->path, with_lists, &run->report);
    if (!hal_replay_open(&visit.replay, dir->path, with_lists, &log, &error)) {
        sim_report_error(&run->report, dir->path, "%s", error.text);
        return;
    }
    sim_truth_load(&visit.truth, dir->path, &visit.replay, &run->report);
    if (!run->options->json) {
        sim_table_title(stdout, dir->path);
    }
    if (run->page.file != NULL) {
        sim_page_dir(&run->page, dir, run->options->rig != NULL ? run->options->rig : "rig.json",
                     run->head);
    }
    process_frames(&visit);
    if (!run->options->json && visit.shown_state == IH_ALIGN_MOVED) {
        sim_table_rig(stdout, run->head);
    }
    report_hints(&visit);
    release(&visit, &visit.ambient);
    sim_truth_report(&visit.truth, &run->report);
    sim_truth_free(&visit.truth);
    sim_cloud_free(&visit.cloud);
    hal_replay_close(&visit.replay);
}

/* To be freed. */
static struct sim_score sum_scores(const struct run *run)
{
    struct sim_score sum = {.true_dot_count = 0};
    for (size_t i = 0; i < run->dirs.dir_count; i++) {
        sim_score_merge(&sum, &run->score[i]);
    }
    return sum;
}

static void print_tables(struct run *run)
{
    struct sim_score sum = sum_scores(run);
    size_t count = run->dirs.dir_count;
    if (sum.with_head.frame_count + sum.empty.frame_count > 0) {
        sim_table_heading(stdout);
        for (size_t i = 0; i < count; i++) {
            sim_table_row(stdout, run->dirs.dir[i].label, &run->score[i]);
        }
        if (count > 1) {
            sim_table_row(stdout, "all", &sum);
        }
    }
    if (sum.true_dot_count > 0) {
        sim_table_dots_heading(stdout);
        for (size_t i = 0; i < count; i++) {
            sim_table_dots_row(stdout, run->dirs.dir[i].label, &run->score[i]);
        }
        if (count > 1) {
            sim_table_dots_row(stdout, "all", &sum);
        }
    }
    sim_score_free(&sum);
}

/* The page's end, and where it is. */
static void finish_page(struct run *run)
{
    struct hal_error error;
    const char *path = run->options->report;
    size_t frame_count = run->page.frame_count;
    for (size_t i = 0; i < run->dirs.dir_count; i++) {
        sim_page_row(&run->page, run->dirs.dir[i].label, &run->score[i]);
    }
    if (run->dirs.dir_count > 1) {
        struct sim_score sum = sum_scores(run);
        sim_page_row(&run->page, "all", &sum);
        sim_score_free(&sum);
    }
    if (!sim_page_close(&run->page, &error)) {
        sim_report_error(&run->report, path, "%s", error.text);
    } else if (!run->options->json) {
        printf("\nReport of %zu frames, to be opened in a browser: %s\n", frame_count, path);
    }
}

/* The page would replace it. */
static bool is_input(const struct run *run, const char *path)
{
    const char *const own[] = {run->options->rig, run->options->against};
    struct stat page, file;
    bool is_own = false;
    for (size_t i = 0; i < sizeof own / sizeof *own && stat(path, &page) == 0; i++) {
        is_own = is_own || (own[i] != NULL && stat(own[i], &file) == 0 &&
                            file.st_dev == page.st_dev && file.st_ino == page.st_ino);
    }
    return is_own || sim_dirs_has_input(&run->dirs, path);
}

/* False: the page cannot be written, which is reported before any frame is processed. */
static bool start_page(struct run *run)
{
    struct hal_error error;
    const char *path = run->options->report;
    if (path == NULL) {
        return true;
    }
    if (is_input(run, path)) {
        hal_fail(&error, "a file that this run reads, expected another one for the report");
    } else if (sim_page_open(&run->page, path, &error)) {
        sim_page_run(&run->page, run->options, &run->report);
        return true;
    }
    sim_report_error(&run->report, path, "%s", error.text);
    return false;
}

/* Traces must not lie among frames, where that of rig.pgm would replace rig.json. True: one would, which is reported. */
static bool has_trace_in_frames(struct run *run)
{
    bool found = false;
    for (size_t i = 0; run->options->trace != NULL && i < run->dirs.dir_count; i++) {
        const struct sim_trace trace = {.out = run->options->trace,
                                        .label = run->dirs.dir[i].label};
        char *folder = sim_trace_folder(&trace);
        if (folder != NULL && sim_dirs_has(&run->dirs, folder)) {
            sim_report_error(&run->report, folder,
                             "a frames directory of this run, expected another OUT of --trace");
            found = true;
        }
        free(folder);
    }
    return found;
}

/* False: nothing can be written where traces are wanted, which is reported before any frame is processed. */
static bool prepare_traces(struct run *run)
{
    struct hal_error error;
    bool good = true;
    for (size_t i = 0; run->options->trace != NULL && i < run->dirs.dir_count; i++) {
        const struct sim_trace trace = {.out = run->options->trace,
                                        .label = run->dirs.dir[i].label};
        if (good && !sim_trace_prepare(&trace, &error)) {
            sim_report_error(&run->report, run->dirs.dir[i].path, "%s", error.text);
            good = false;
        }
    }
    return good;
}

static void process_all(struct run *run)
{
    size_t count = run->dirs.dir_count;
    run->score = sim_report_grow(NULL, count + 1, sizeof *run->score);
    memset(run->score, 0, (count + 1) * sizeof *run->score);
    for (size_t i = 0; i < count && !ferror(stdout); i++) {
        process_dir(run, i);
        run->done_count += run->dirs.dir[i].file_count;
    }
    if (!run->options->json) {
        print_tables(run);
    }
    if (run->page.file != NULL) {
        finish_page(run);
    } else if (!run->options->json && isatty(STDOUT_FILENO)) {
        printf("\nWhy each frame came out so, in a browser: host_sim --report report.html %s\n",
               run->options->dirs[0]);
    }
    for (size_t i = 0; i < count; i++) {
        sim_score_free(&run->score[i]);
    }
    free(run->score);
}

enum sim_status sim_run(const struct sim_options *options, struct isohead *head)
{
    struct run run = {.options = options, .head = head};
    sim_report_init(&run.report);
    for (int i = 0; i < options->dir_count; i++) {
        sim_dirs_add(&run.dirs, options->dirs[i], options->rig != NULL, &run.report);
    }
    const bool is_usage = has_trace_in_frames(&run);
    if (!is_usage && prepare_traces(&run) && start_page(&run)) {
        process_all(&run);
    }
    if (fflush(stdout) != 0 || ferror(stdout)) {
        sim_report_error(&run.report, STDOUT_NAME, "cannot be written: %s", strerror(errno));
    }
    sim_dirs_free(&run.dirs);
    if (is_usage) {
        return SIM_STATUS_USAGE;
    }
    return run.report.error_count == 0 ? SIM_STATUS_GOOD : SIM_STATUS_INPUT;
}
