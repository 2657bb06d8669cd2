#include "sim_hint.h"

#include <dirent.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "app_rig.h"
#include "replay/hal_replay.h"

#define DOTS_MIN 60
/* Labels by chance: few, or not half of the dots and beside lines that do not fit. */
#define LABELS_DIVISOR 5
#define CHANCE_DIVISOR 2
#define CHANCE_PX_Q12 737 /* 0.18 px; 0.13 where the rig is right */
#define DEPTHS 65536
/* A path of 4096 bytes, and what is said of it; longer ones are cut. */
#define TEXT_MAX 4608
/* Per cent. */
#define MEASURED_MIN 1
#define IN_RANGE_MIN 2
#define IN_RANGE_MIN_SWAPPED 33
#define EXPLAINED_MIN 80

/* What may hold frames and is not read: suffix, and how it becomes frames. */
#define IMAGE "ffmpeg -i %s -pix_fmt gray 000000.png (gray16be where it has more than 8 bits)"
#define VIDEO "ffmpeg -i %s -pix_fmt gray %%06d.png (docs/depth_camera.md has the times)"
#define DUMP "ffmpeg -f rawvideo -pixel_format gray -video_size WIDTHxHEIGHT -i %s %%06d.png"
#define NUMBERS "%s: docs/depth_camera.md writes depth images with a few lines of Python"
static const struct {
    const char *suffix, *recipe;
} unread[] = {
    {".tif", IMAGE},   {".tiff", IMAGE},
    {".jpg", IMAGE},   {".jpeg", IMAGE},
    {".bmp", IMAGE},   {".ppm", IMAGE},
    {".pnm", IMAGE},   {".webp", IMAGE},
    {".avi", VIDEO},   {".mp4", VIDEO},
    {".mkv", VIDEO},   {".mov", VIDEO},
    {".webm", VIDEO},  {".raw", DUMP},
    {".bin", DUMP},    {".yuv", DUMP},
    {".npy", NUMBERS}, {".npz", NUMBERS},
    {".exr", NUMBERS}, {".ply", NUMBERS},
    {".pcd", NUMBERS}, {".xyz", "%s: lists of points need a rig of \"kind\": \"range\""},
};
#define UNREAD (int)(sizeof unread / sizeof unread[0])

/* What depths may be by mistake: mm are value * multiplier / divisor. Not micrometres: 16 bits are 65 mm. */
struct unit {
    const char *text;
    int32_t multiplier, divisor;
    bool is_swapped;
};

static const struct unit units[] = {
    {"mm", 1, 1, false},
    {"mm with their bytes swapped (PGM and PNG have the most significant one first)", 1, 1, true},
    {"cm", 10, 1, false},
    {"0.1 mm (or 0.2 mm, as in the sets of TUM)", 1, 10, false},
    {"metres", 1000, 1, false},
};
#define UNITS (int)(sizeof units / sizeof units[0])

/* NULL: it is read, or is no frame. */
static const char *recipe_of(const char *name, bool with_lists)
{
    const char *suffix = strrchr(name, '.');
    if (suffix == NULL || name[0] == '.' || hal_replay_is_frame(name, with_lists)) {
        return NULL;
    }
    for (int i = 0; i < UNREAD; i++) {
        if (strcasecmp(suffix, unread[i].suffix) == 0) {
            return unread[i].recipe;
        }
    }
    return NULL;
}

void sim_hint_unread(const char *dir, bool with_lists, struct sim_report *report)
{
    char first[NAME_MAX + 1] = "";
    int count = 0;
    DIR *stream = opendir(dir);
    const struct dirent *item = NULL;
    while (stream != NULL && (item = readdir(stream)) != NULL) {
        if (recipe_of(item->d_name, with_lists) == NULL) {
            continue;
        }
        if (count == 0 || strcmp(item->d_name, first) < 0) {
            snprintf(first, sizeof first, "%s", item->d_name);
        }
        count++;
    }
    if (stream != NULL) {
        closedir(stream);
    }
    if (count == 0) {
        return;
    }
    char text[TEXT_MAX];
    int length =
        snprintf(text, sizeof text, "%d file%s not read, as frames are *.pgm and *.png%s: ", count,
                 count == 1 ? " is" : "s are", with_lists ? " and *.xyz" : "");
    snprintf(text + length, sizeof text - (size_t)length, recipe_of(first, with_lists), first);
    sim_report_hint(report, dir, text);
}

static void count_depths(struct sim_hint *hint, const struct ih_frame *view)
{
    if (hint->depth_count == NULL) {
        hint->depth_count = sim_report_grow(NULL, DEPTHS, sizeof *hint->depth_count);
        memset(hint->depth_count, 0, DEPTHS * sizeof *hint->depth_count);
    }
    for (int32_t v = 0; v < view->height; v++) {
        const uint16_t *line =
            (const void *)((const char *)view->samples + (size_t)v * (size_t)view->stride_bytes);
        for (int32_t u = 0; u < view->width; u++) {
            hint->depth_count[line[u]]++;
        }
    }
    hint->pixel_count += (int64_t)view->width * view->height;
}

static bool is_bare(const struct isohead *head)
{
    const int32_t dot_count = head->dots.dot_count;
    const int32_t labelled_count = head->labels.labelled_count;
    return labelled_count * LABELS_DIVISOR < dot_count ||
           (labelled_count * CHANCE_DIVISOR < dot_count && head->align.now.state != IH_ALIGN_FITS &&
            head->align.now.across_px_q12 > CHANCE_PX_Q12);
}

void sim_hint_frame(struct sim_hint *hint, const struct isohead *head, const struct ih_frame *view)
{
    if (head->rig.calibration.kind == IH_RIG_RANGE) {
        count_depths(hint, view);
    } else if (head->dots.dot_count >= DOTS_MIN) {
        hint->dotted_count++;
        hint->bare_count += is_bare(head);
        hint->on_lines_count += is_bare(head) && head->align.now.state == IH_ALIGN_FITS;
    }
}

static void report_dots(const struct sim_hint *hint, const struct isohead *head, const char *dir,
                        const char *rig, struct sim_report *report)
{
    if (2 * hint->bare_count <= hint->dotted_count) {
        return;
    }
    char text[TEXT_MAX];
    if (2 * hint->on_lines_count > hint->bare_count) {
        snprintf(text, sizeof text,
                 "hardly a dot has a good label in %" PRId32 " of %" PRId32
                 " frames, but dots lie on the lines of %s: what is seen is nearer than %" PRId32
                 " or farther than %" PRId32 " mm, or the projector is nearer to the camera or "
                 "farther from it than that file says",
                 hint->bare_count, hint->dotted_count, rig, head->rig.calibration.near_mm,
                 head->rig.calibration.far_mm);
        sim_report_hint(report, dir, text);
        return;
    }
    snprintf(text, sizeof text,
             "hardly a dot has a good label in %" PRId32 " of %" PRId32
             " frames: %s does not fit these frames. Use the rig file of this camera and "
             "laser; if it is, %s. Or all that is seen is nearer than %" PRId32
             " or farther than %" PRId32 " mm",
             hint->bare_count, hint->dotted_count, rig,
             head->params.is_paper
                 ? "they have moved: calibrate again, or try without --paper"
                 : "they have moved by more than can be corrected: calibrate again",
             head->rig.calibration.near_mm, head->rig.calibration.far_mm);
    sim_report_hint(report, dir, text);
}

static int64_t depth_of(const struct unit *unit, int32_t value)
{
    int64_t read = unit->is_swapped ? (value >> 8) | (value & 255) << 8 : value;
    return read * unit->multiplier / unit->divisor;
}

/* Pixels within the working range, were that the unit. */
static int64_t in_range_count(const struct sim_hint *hint, const struct ih_calibration *rig,
                              const struct unit *unit)
{
    int64_t count = 0;
    for (int32_t value = 1; value < DEPTHS; value++) {
        int64_t depth_mm = depth_of(unit, value);
        bool is_in = depth_mm >= rig->near_mm && depth_mm <= rig->far_mm;
        count += is_in ? hint->depth_count[value] : 0;
    }
    return count;
}

static int32_t median_depth(const struct sim_hint *hint, int64_t measured_count)
{
    int32_t value = 0;
    for (int64_t below = 0; value < DEPTHS - 1 && 2 * below < measured_count;) {
        value++;
        below += hint->depth_count[value];
    }
    return value;
}

static int percent(int64_t part, int64_t of)
{
    return (int)(part * 100 / of);
}

/* The unit that explains most of the depths; 0: none does. */
static int find_unit(const struct sim_hint *hint, const struct ih_calibration *rig,
                     int64_t measured_count, int64_t good_count)
{
    int best = 0;
    int64_t best_count = 0;
    for (int i = 1; i < UNITS; i++) {
        int min = units[i].is_swapped ? IN_RANGE_MIN_SWAPPED : IN_RANGE_MIN;
        int64_t count = in_range_count(hint, rig, &units[i]);
        bool is_raw =
            hint->scale_q20 == APP_RIG_SCALE_ONE; /* else its bytes are not those of the file */
        if ((is_raw || !units[i].is_swapped) && percent(good_count, measured_count) < min &&
            percent(count, measured_count) >= EXPLAINED_MIN && count > best_count) {
            best = i;
            best_count = count;
        }
    }
    return best;
}

static void report_depths(const struct sim_hint *hint, const struct ih_calibration *rig,
                          const char *dir, const char *rig_path, struct sim_report *report)
{
    const int64_t measured_count = hint->pixel_count - hint->depth_count[0];
    if (measured_count == 0 || percent(measured_count, hint->pixel_count) < MEASURED_MIN) {
        return;
    }
    const int64_t good_count = in_range_count(hint, rig, &units[0]);
    const int unit = find_unit(hint, rig, measured_count, good_count);
    const int good_percent = percent(good_count, measured_count);
    char text[TEXT_MAX];
    if (unit != 0) {
        char scale[32];
        snprintf(scale, sizeof scale, "%.4g",
                 (double)hint->scale_q20 / APP_RIG_SCALE_ONE * units[unit].multiplier /
                     units[unit].divisor);
        bool is_swapped = units[unit].is_swapped;
        snprintf(text, sizeof text,
                 "%d %% of its depths lie within %" PRId32 " .. %" PRId32
                 " mm, but %d %% would if they were %s: %s%s%s%s",
                 good_percent, rig->near_mm, rig->far_mm,
                 percent(in_range_count(hint, rig, &units[unit]), measured_count), units[unit].text,
                 is_swapped ? "write the frames again" : "enter \"depth_scale\": ",
                 is_swapped ? "" : scale, is_swapped ? "" : " in ", is_swapped ? "" : rig_path);
    } else if (good_percent < IN_RANGE_MIN) {
        snprintf(
            text, sizeof text,
            "%d %% of its depths lie within %" PRId32 " .. %" PRId32 " mm, the median is %" PRId32
            " mm: use the rig file of this sensor, or correct near_mm and far_mm in %s",
            good_percent, rig->near_mm, rig->far_mm, median_depth(hint, measured_count), rig_path);
    } else {
        return;
    }
    sim_report_hint(report, dir, text);
}

void sim_hint_report(const struct sim_hint *hint, const struct isohead *head, const char *dir,
                     const char *rig, struct sim_report *report)
{
    if (hint->depth_count != NULL) {
        report_depths(hint, &head->rig.calibration, dir, rig, report);
    } else {
        report_dots(hint, head, dir, rig, report);
    }
}

void sim_hint_free(struct sim_hint *hint)
{
    free(hint->depth_count);
}
