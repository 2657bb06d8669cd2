#include "app_live.h"

#include <stdlib.h>
#include <string.h>

#include "app_write.h"
#include "rig/ih_level.h"

#define PIXEL_DECIMALS 2
/* Every third contour level of the core is drawn: 30 mm apart they can be distinguished. */
#define LEVEL_STEP 3
/* Rows of the picture between two pauses. */
#define PAUSE_ROWS 8

size_t app_live_size(int32_t width, int32_t height)
{
    return sizeof(struct app_live) + (size_t)width * (size_t)height * sizeof(uint16_t);
}

void app_live_put(struct app_live *live, const struct hal_frame *frame, const struct isohead *head,
                  const struct app_record *record, int64_t frame_count)
{
    size_t row_bytes = (size_t)frame->width * (size_t)frame->bytes_per_sample;
    const unsigned char *from = frame->samples;
    live->frame_count = frame_count;
    live->width = frame->width;
    live->height = frame->height;
    live->bytes_per_sample = frame->bytes_per_sample;
    live->maximum = frame->maximum;
    live->record_length = record->length;
    memcpy(live->record, record->text, record->length);
    memcpy(&live->head, head, offsetof(struct isohead, scratch));
    for (int32_t row = 0; row < frame->height; row++) {
        memcpy(live->samples + (size_t)row * row_bytes, from + (ptrdiff_t)row * frame->stride_bytes,
               row_bytes);
    }
}

/* --- the other process --- */

/* The camera's samples in a row or column that are one of the picture's. */
static int32_t scale_of(const struct app_live *live)
{
    return live->width / APP_LIVE_ROW_MAX + 1;
}

static void write_px(struct app_write *write, int32_t px_q12)
{
    app_write_decimal(write, app_text_fixed(px_q12, 12, PIXEL_DECIMALS));
}

static void write_dots(struct app_write *write, const struct isohead *head)
{
    app_write_key(write, "dots");
    app_write_open(write, '[');
    for (int32_t i = 0; i < head->dots.dot_count; i++) {
        app_write_open(write, '[');
        write_px(write, head->dots.dot[i].u_px_q12);
        write_px(write, head->dots.dot[i].v_px_q12);
        app_write_close(write, ']');
    }
    app_write_close(write, ']');
    app_write_key(write, "labelled");
    app_write_open(write, '[');
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (head->labels.dot_of_slot[slot] != IH_NONE) {
            app_write_int(write, head->labels.dot_of_slot[slot]);
        }
    }
    app_write_close(write, ']');
}

/* A position on the surface's grid in normalised coordinates. */
static int32_t slope_q28(int32_t centre_q28, int32_t unit_q28, int32_t place_q9)
{
    int64_t steps_q9 = (int64_t)place_q9 - (IH_SURFACE_GRID - 1) / 2 * 512;
    int64_t from_centre =
        steps_q9 * unit_q28 * IH_SURFACE_STEP_NUMERATOR / (IH_SURFACE_STEP_DENOMINATOR * 512);
    return (int32_t)(centre_q28 + from_centre);
}

static void write_vertex(struct app_write *write, const struct isohead *head,
                         const struct ih_vertex *vertex)
{
    const struct ih_field *field = &head->surface.field;
    int32_t u_px_q12 = 0, v_px_q12 = 0;
    (void)ih_level_sees(&head->rig, slope_q28(field->centre_x_q28, field->unit_q28, vertex->x_q9),
                        slope_q28(field->centre_y_q28, field->unit_q28, vertex->y_q9), &u_px_q12,
                        &v_px_q12);
    app_write_decimal(write, app_text_fixed(u_px_q12, 12, 0));
    app_write_decimal(write, app_text_fixed(v_px_q12, 12, 0));
}

static void write_level(struct app_write *write, const struct isohead *head,
                        const struct ih_contours *contours, void (*pause)(void))
{
    for (int32_t i = 0; i < contours->contour_count; i++) {
        const struct ih_contour *contour = &contours->contour[i];
        app_write_open(write, '{');
        app_write_key(write, "level_mm");
        app_write_decimal(write, app_text_fixed(contours->level_mm_q8, 8, 0));
        app_write_key(write, "closed");
        app_write_bool(write, contour->closed);
        app_write_key(write, "px");
        app_write_open(write, '[');
        for (int32_t k = 0; k < contour->vertex_count; k++) {
            write_vertex(write, head, &contours->vertex[contour->first + k]);
        }
        app_write_close(write, ']');
        app_write_close(write, '}');
        pause();
    }
}

static void write_contours(struct app_write *write, struct isohead *head, void (*pause)(void))
{
    struct ih_contours *contours = &head->scratch.nests.contours;
    int32_t level_mm_q8 = 0;
    app_write_key(write, "contours");
    app_write_open(write, '[');
    for (int32_t index = 0;
         head->surface.valid &&
         ih_nests_level(&head->surface, &head->params.nests, index, &level_mm_q8);
         index += LEVEL_STEP) {
        ih_contours_level(&head->surface, level_mm_q8, contours);
        pause();
        write_level(write, head, contours, pause);
    }
    app_write_close(write, ']');
}

/* Clockwise: the side of the picture that is nearest to where up is comes to the top. */
static int32_t rotation_deg(const int32_t up_q30[3])
{
    const int64_t right = up_q30[0];
    const int64_t down = up_q30[1];
    if (llabs(right) > llabs(down)) {
        return right > 0 ? 270 : 90;
    }
    return down > 0 ? 180 : 0;
}

static void write_text(struct app_live *live, struct app_write *write, void (*pause)(void))
{
    app_write_open(write, '{');
    app_write_int_field(write, "frame", live->frame_count);
    app_write_int_field(write, "width", live->width);
    app_write_int_field(write, "height", live->height);
    app_write_int_field(write, "scale", scale_of(live));
    app_write_int_field(write, "rotate_deg", rotation_deg(live->head.rig.calibration.up_q30));
    write_dots(write, &live->head);
    pause();
    write_contours(write, &live->head, pause);
    app_write_close(write, '}');
    app_write_line_end(write);
}

/* Adds scale samples to each of a row's sums. */
static void add_row(const struct app_live *live, int32_t row, uint32_t *sum)
{
    const int32_t scale = scale_of(live);
    const int32_t used = live->width / scale * scale;
    const size_t first = (size_t)row * (size_t)live->width;
    for (int32_t column = 0, place = 0; column < used; place++) {
        for (int32_t end = column + scale; column < end; column++) {
            uint16_t sample = 0;
            if (live->bytes_per_sample == 1) {
                sample = live->samples[first + (size_t)column];
            } else {
                memcpy(&sample, live->samples + (first + (size_t)column) * sizeof sample,
                       sizeof sample);
            }
            sum[place] += sample;
        }
    }
}

/* Means, to 8 bits: full scale becomes 255. A sum is below 4 * 4 * 2^16, and so is the divisor. */
static size_t write_picture(const struct app_live *live, unsigned char *to, void (*pause)(void))
{
    const int32_t scale = scale_of(live);
    const uint32_t full = (uint32_t)(live->maximum * scale * scale);
    size_t count = 0;
    for (int32_t row = 0; row < live->height / scale; row++) {
        uint32_t sum[APP_LIVE_ROW_MAX] = {0};
        for (int32_t y = 0; y < scale; y++) {
            add_row(live, row * scale + y, sum);
        }
        for (int32_t place = 0; place < live->width / scale; place++) {
            uint32_t grey = sum[place] * 255U / full;
            to[count++] = (unsigned char)(grey < 255U ? grey : 255U);
        }
        if (row % PAUSE_ROWS == 0) {
            pause();
        }
    }
    return count;
}

static bool is_whole(const struct app_live *live, size_t live_size)
{
    return live->width > 0 && live->height > 0 && live->width <= IH_FRAME_WIDTH_MAX &&
           live->height <= IH_FRAME_HEIGHT_MAX &&
           app_live_size(live->width, live->height) <= live_size && live->maximum > 0 &&
           live->maximum <= UINT16_MAX && live->record_length > 0 &&
           live->record_length <= sizeof live->record && live->head.dots.dot_count >= 0 &&
           live->head.dots.dot_count <= IH_DOTS_MAX;
}

size_t app_live_write(void *content, size_t content_size, unsigned char *to, size_t size,
                      void (*pause)(void))
{
    struct app_live *live = content;
    if (!is_whole(live, content_size)) {
        return 0;
    }
    size_t more = live->record_length + (size_t)live->width * (size_t)live->height;
    if (more >= size) {
        return 0;
    }
    struct app_write write = {.memory = (char *)to, .size = size - more};
    write_text(live, &write, pause);
    if (write.full) {
        return 0;
    }
    memcpy(to + write.length, live->record, live->record_length);
    size_t length = write.length + live->record_length;
    return length + write_picture(live, to + length, pause);
}
