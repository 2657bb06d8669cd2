/* ih_types - error codes and the frame view shared by all stages. */
#ifndef IH_TYPES_H
#define IH_TYPES_H

#include <stdint.h>

#include "base/ih_config.h"

/* Every function that can fail returns one of these; 0 is success. Seeing nothing in a frame is
 * success, a full table is success and a counter. */
enum ih_err {
    IH_OK = 0,
    IH_ERR_SIZE = -1,         /* a width, height, stride or maximum that is out of bounds */
    IH_ERR_FOCAL = -2,        /* focal length not positive or above IH_RIG_FOCAL_MAX_PX */
    IH_ERR_PRINCIPAL = -3,    /* with this focal length and principal point, the frame's border is
                                 seen at more than IH_RIG_TAN_MAX from the optical axis */
    IH_ERR_DISTORTION = -4,   /* distortion that cannot be undone everywhere in the frame */
    IH_ERR_RANGE = -5,        /* near and far out of order or out of bounds */
    IH_ERR_BASELINE = -6,     /* projector origin on the camera's centre, or too far away */
    IH_ERR_RAY = -7,          /* a dot ray that is no unit vector or not forward; dots too close */
    IH_ERR_KIND = -8,         /* a range frame for a dot rig, or the other way round */
    IH_ERR_NOT_POSITIVE = -9, /* Cholesky met a pivot that is not positive */
    /* A rig as bytes (ih_rig_blob.h). */
    IH_ERR_BLOB_SHORT = -10,   /* bytes are missing */
    IH_ERR_BLOB_LONG = -11,    /* bytes follow */
    IH_ERR_BLOB_MAGIC = -12,   /* something else */
    IH_ERR_BLOB_VERSION = -13, /* another version */
    IH_ERR_BLOB_LENGTH = -14,  /* a length that the version does not have */
    IH_ERR_BLOB_CRC = -15,     /* changed bytes */
    IH_ERR_BLOB_FIELD = -16,   /* a kind that does not exist, or a range rig with a projector */
    IH_ERR_UP = -17, /* up that is no unit vector, or within 10 degrees of the optical axis */
};

IH_BEGIN_DECLS

/* One line of English for a code, without a full stop; never NULL. */
const char *ih_err_text(enum ih_err err);

/* A view of one frame. The core reads it and never copies or keeps it.
 * bytes_per_sample 1: uint8_t samples; 2: uint16_t samples in the processor's own byte order,
 * stored as uint16_t (on even addresses).
 * maximum: the value of full scale, 1..255 or 1..65535. Samples above it count as full scale.
 * A range frame has 2 bytes per sample, Z depth in mm, 0 = no measurement; maximum is ignored. */
struct ih_frame {
    const void *samples;
    int32_t width;
    int32_t height;
    int32_t stride_bytes; /* from one row to the next */
    int32_t bytes_per_sample;
    int32_t maximum;
};

IH_END_DECLS

#endif
