/* app_live - a frame and all that was found in it, for the live view: how the loop hands it over, and
 * how it is written for the page (docs/live.md).
 *
 * app_live_put copies: the samples as they are, every stage's outputs, the record. It is all that the
 * loop does for the view, and only for a frame that a viewer waits for. app_live_write, in the other
 * process, computes the contours again, as the core does not keep them, and writes
 *     {"frame":N,"width":W,"height":H,"scale":K,"rotate_deg":R,"dots":[[u,v],..],"labelled":[index,..],
 *      "contours":[{"level_mm":Z,"closed":true,"px":[u,v,u,v,..]},..]}
 *     the record, as it was sent
 *     the picture, W / K by H / K samples of 8 bits, row by row without gaps
 * with line ends between the three. The picture is upright when it is rotated clockwise by R, which is 0, 90, 180
 * or 270. Positions are frame pixels as in a record, those of contours whole. A sample is the mean of K by K of
 * the camera's; K is such that a row is shorter than
 * APP_LIVE_ROW_MAX: sending costs the board more than all else here, and dots, contours and ellipses
 * are drawn from numbers anyway.
 */
#ifndef APP_LIVE_H
#define APP_LIVE_H

#include "app_record.h"

/* Samples of a row that is sent are fewer than this. */
#define APP_LIVE_ROW_MAX 400
/* Most bytes that what is written has more than what was put: 2048 vertices of 10 bytes at each of 24
 * levels, 512 dots and 361 labels would be 520 KB; 50 KB are usual. */
#define APP_LIVE_WRITE_MORE (1024 * 1024)

struct app_live {
    int64_t frame_count;                              /* with a result, since the program began */
    int32_t width, height, bytes_per_sample, maximum; /* of the samples */
    size_t record_length;
    char record[APP_RECORD_MAX];
    struct isohead head; /* but for its scratch, which the writer uses */
    unsigned char samples[];
};

/* Bytes for frames of this size. */
size_t app_live_size(int32_t width, int32_t height);

/* The frame is of the rig's size. */
void app_live_put(struct app_live *live, const struct hal_frame *frame, const struct isohead *head,
                  const struct app_record *record, int64_t frame_count);

/* pause is called after each short piece of work. Length; 0: this is no frame of that size, or there is
 * no room. For hal_serve: content_size and the numbers in content may be anything; results are the core's. */
size_t app_live_write(void *content, size_t content_size, unsigned char *to, size_t size,
                      void (*pause)(void));

#endif
