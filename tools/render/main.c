/* render - draws synthetic frames directories: scene, light, laser dots, sensor; see render --help.
 * Steps of a frame: stage (which shapes) -> ambient (grey picture) -> dots (laser) -> sensor (numbers) -> output.
 */
#define _POSIX_C_SOURCE 200809L

#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "rd_ambient.h"
#include "rd_depth.h"
#include "rd_dots.h"
#include "rd_options.h"
#include "rd_output.h"
#include "rd_rig.h"
#include "rd_sensor.h"
#include "rd_stage.h"

struct studio {
    struct rd_rig rig, start_rig, written_rig; /* as it is, as it was in frame 0, and as rig.json has it */
    struct rd_laser laser;
    struct rd_sensor sensor;
    struct rd_depth depth; /* instead of laser and sensor, where the rig is a depth camera */
    struct rd_stage stage;
    struct rd_dot_list dots;
    struct rd_ambient *ambient;
    float *grey;
    uint16_t *samples;
};

static void studio_free(struct studio *studio)
{
    if (studio == NULL)
        return;
    rd_stage_end(&studio->stage);
    rd_ambient_free(studio->ambient);
    rd_depth_free(&studio->depth);
    free(studio->grey);
    free(studio->samples);
    free(studio);
}

/* NULL: out of memory. */
static struct studio *studio_new(const struct rd_options *options)
{
    struct studio *studio = calloc(1, sizeof *studio);
    size_t pixel_count = (size_t)options->width * (size_t)options->height;
    if (studio == NULL)
        return NULL;
    rd_rig_make(&studio->rig, options);
    studio->written_rig = studio->rig;
    rd_rig_knock(&studio->rig, options);
    studio->start_rig = studio->rig;
    rd_rig_misjudge(&studio->written_rig, options);
    rd_laser_make(&studio->laser, options, &studio->rig);
    rd_sensor_make(&studio->sensor, options);
    studio->ambient = rd_ambient_new(&studio->rig);
    studio->grey = malloc(pixel_count * sizeof *studio->grey);
    studio->samples = malloc(pixel_count * sizeof *studio->samples);
    bool depth_made = !studio->rig.is_range || rd_depth_make(&studio->depth, options, &studio->rig);
    if (studio->ambient == NULL || studio->grey == NULL || studio->samples == NULL || !depth_made) {
        studio_free(studio);
        return NULL;
    }
    return studio;
}

static bool render_depth(struct studio *studio, struct rd_output *output, int frame)
{
    struct rd_stage *stage = &studio->stage;
    struct rd_frame_note note = {stage->time_us, true, stage->source};
    rd_depth_expose(&studio->depth, &studio->rig, &stage->scene, frame, studio->samples);
    rd_output_truth(output, frame, &stage->truth, NULL);
    return rd_output_frame(output, frame, &note, &studio->rig, RD_DEPTH_MAX, studio->samples);
}

static bool render_frame(struct studio *studio, struct rd_output *output, int frame)
{
    struct rd_stage *stage = &studio->stage;
    if (stage->frame_count > 1)
        rd_rig_drift(&studio->rig, &studio->start_rig, &stage->options, frame / (stage->frame_count - 1.0));
    if (!rd_stage_frame(stage, frame))
        return false;
    if (studio->rig.is_range)
        return render_depth(studio, output, frame);
    if (stage->still_changed || stage->light.shadows) {
        rd_ambient_still(studio->ambient, &stage->scene, &stage->light);
        if (stage->truth.board_known)
            rd_ambient_edges(studio->ambient, &studio->rig, &stage->scene, &stage->light);
    }
    rd_ambient_frame(studio->ambient, &stage->scene, &stage->light, studio->grey);
    struct rd_frame_note note = {stage->time_us, !stage->options.alternate || frame % 2 == 0, stage->source};
    if (note.laser) {
        rd_dots_cast(&studio->laser, &studio->rig, &stage->scene, frame, studio->grey, &studio->dots);
        rd_output_truth(output, frame, &stage->truth, &studio->dots);
    }
    if (stage->options.blur_px > 0.0)
        rd_ambient_blur(studio->ambient, stage->options.blur_px, studio->grey);
    rd_sensor_expose(&studio->sensor, studio->grey, frame, studio->samples);
    return rd_output_frame(output, frame, &note, &studio->rig, studio->sensor.max_value, studio->samples);
}

static double now_s(void)
{
    struct timespec now = {.tv_sec = 0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

/* The frame that is begun; the rate, and the time that is left at it, once they mean something. */
static void report_progress(const char *dir, int done, int count, double run_s)
{
    fprintf(stderr, "\r\033[Krender: %s %d/%d", dir, done + 1, count);
    if (done > 0 && run_s >= 2) {
        int left_s = (int)(run_s / done * (count - done)) + 1;
        fprintf(stderr, ", %.1f frames/s, %d:%02d min left", done / run_s, left_s / 60, left_s % 60);
    }
}

static bool render_all(struct studio *studio, const struct rd_options *options)
{
    struct rd_output output;
    bool talk = isatty(STDERR_FILENO) == 1;
    int first = options->first_frame, end = studio->stage.frame_count;
    if (options->shown_count > 0 && options->shown_count < end - first)
        end = first + options->shown_count;
    double start_s = now_s();
    bool good = rd_output_open(&output, options->out_dir);
    for (int frame = first; good && frame < end; frame++) {
        if (talk)
            report_progress(options->out_dir, frame - first, end - first, now_s() - start_s);
        good = render_frame(studio, &output, frame);
    }
    if (talk)
        fputc('\n', stderr);
    if (good)
        good = rd_output_finish(&output, &studio->written_rig, first, end);
    else
        rd_output_abandon(&output);
    return good;
}

int main(int argc, char **argv)
{
    struct rd_options options;
    enum rd_options_result parsed = rd_options_parse(argc, argv, &options);
    if (parsed != RD_OPTIONS_RUN)
        return parsed == RD_OPTIONS_HELP ? 0 : 2;
    struct studio *studio = studio_new(&options);
    if (studio == NULL) {
        fputs("render: out of memory\n", stderr);
        return 1;
    }
    int status = rd_stage_make(&studio->stage, &options, &studio->rig) ? 0 : 1;
    if (status == 0 && options.first_frame >= studio->stage.frame_count) {
        fprintf(stderr, "render: --first-frame %d: there are only %d frames\n", options.first_frame,
                studio->stage.frame_count);
        status = 2;
    }
    if (status == 0 && !render_all(studio, &options))
        status = 1;
    studio_free(studio);
    return status;
}
