/* sim_image - a frame as a small JPEG for the report page.
 *
 * In:    the frame as the core sees it.
 * Out:   grey, at most SIM_IMAGE_WIDTH_MAX wide, made smaller by a whole factor. A camera's image keeps
 *        its levels; of a depth image near is bright, far is dark, and black was not measured.
 * Error: false with the library's reason.
 */
#ifndef SIM_IMAGE_H
#define SIM_IMAGE_H

#include "hal.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

#define SIM_IMAGE_WIDTH_MAX 640

struct sim_image {
    uint8_t *grey; /* memory that is used again for the next frame */
    uint8_t *jpeg; /* the last one's */
    size_t jpeg_size, jpeg_capacity;
    void *handle; /* of the library */
};

bool sim_image_encode(struct sim_image *image, const struct ih_frame *frame,
                      const struct ih_rig *rig, struct hal_error *error);
void sim_image_free(struct sim_image *image);

#endif
