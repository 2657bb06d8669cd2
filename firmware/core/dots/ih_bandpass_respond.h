/* ih_bandpass_respond - the response R of a row from its sums; private to the band-pass.
 *
 * In:     1-2-1 sums of three rows and sums of nine rows (ih_bandpass).
 * Out:    R, and the groups with an R above their limit.
 */
#ifndef IH_BANDPASS_RESPOND_H
#define IH_BANDPASS_RESPOND_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_bandpass.h"
#include "simd/ih_simd.h"

/* 81 inner - 16 outer has no response to a constant. */
#define IH_BANDPASS_INNER 81 /* pixels of the outer box */
#define IH_BANDPASS_OUTER 16 /* weight of the inner kernel */

/* Sums of nine rows of bytes are kept negative where there are vectors: R is a sum then. */
#define IH_BANDPASS_NINE_SIGN (IH_I16_LANES > 0 ? -1 : 1)

/* Sums 1-2-1 of the row above, the row itself and the row below; [0] is pixel 0. */
struct ih_bandpass_rows {
    const uint16_t *above, *middle, *below;
};

IH_BEGIN_DECLS

/* nine[0] is the sum around pixel -IH_BANDPASS_SIDE, of bytes with IH_BANDPASS_NINE_SIGN. */
void ih_bandpass_respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine,
                               int32_t width, struct ih_bandpass_row *out);
void ih_bandpass_respond_grey(const struct ih_bandpass_rows *rows_q4, const uint32_t *nine_q4,
                              int32_t width, struct ih_bandpass_row *out);

IH_END_DECLS

#endif
