/* ih_rig_blob - a calibration as checked bytes, for a board that cannot read rig.json.
 *
 * In:    bytes of any origin and alignment: a file, a page of flash, a message.
 * Out:   struct ih_calibration, as isohead_init takes it; or the bytes of one.
 * Cost:  once per rig: about 60 instructions a byte, no memory beyond the caller's.
 *
 * A blob has IH_RIG_BLOB_BYTES bytes, whatever the rig. All numbers are 32 bits, least significant byte
 * first; those that can be negative are two's complement.
 *
 *   offset   bytes
 *        0       4   magic: 'I' 'H' 'R' 'B'
 *        4       4   version: IH_RIG_BLOB_VERSION
 *        8       4   length of the whole blob: IH_RIG_BLOB_BYTES
 *       12       4   kind: enum ih_rig_kind, 0 or 1
 *       16      52   width height  fx fy cx cy  k1 k2 p1 p2 k3  near far, in the units and formats
 *                    of struct ih_calibration
 *       68      12   origin x y z
 *       80    4332   ray x y z of slot 0, 1, .. 360
 *     4412      12   up x y z
 *     4424       4   CRC-32 (IEEE 802.3, as of zlib and PNG) of all bytes before it
 *
 * A range rig has no projector: its origin and rays are 0. A blob of version 1, which is read too, has no up, as its camera
 * was level: its CRC is at 4412.
 *
 * Error: what is found first, in this order; then the calibration stays as it was.
 *   IH_ERR_BLOB_SHORT    fewer than 12 bytes
 *   IH_ERR_BLOB_MAGIC    it begins with something else
 *   IH_ERR_BLOB_VERSION  of another version, which may have another length
 *   IH_ERR_BLOB_LENGTH   it names a length that this version does not have
 *   IH_ERR_BLOB_SHORT    fewer bytes than it names
 *   IH_ERR_BLOB_LONG     more
 *   IH_ERR_BLOB_CRC      a byte has changed: any 3 bits, or any within 32 of each other, are noticed
 *                        always, more with all but 2^-32
 *   IH_ERR_BLOB_FIELD    a kind that does not exist, or a range rig with a projector
 * That the numbers make a rig is the business of isohead_init alone, whose errors say which does not.
 */
#ifndef IH_RIG_BLOB_H
#define IH_RIG_BLOB_H

#include <stddef.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

#define IH_RIG_BLOB_VERSION 2
#define IH_RIG_BLOB_BYTES (4 * (4 + 16 + 3 * IH_SLOTS + 3 + 1))
#define IH_RIG_BLOB_1_BYTES (IH_RIG_BLOB_BYTES - 12) /* of version 1 */

IH_BEGIN_DECLS

enum ih_err ih_rig_blob_decode(const uint8_t *blob, size_t size, struct ih_calibration *calibration)
    __attribute__((warn_unused_result));

/* IH_ERR_BLOB_FIELD as above; any other calibration has a blob, a wrong one too. */
enum ih_err ih_rig_blob_encode(const struct ih_calibration *calibration,
                               uint8_t blob[IH_RIG_BLOB_BYTES]) __attribute__((warn_unused_result));

/* The CRC alone, of all bytes that are given: a blob has that of those before it at its end. */
uint32_t ih_rig_blob_crc32(const uint8_t *bytes, size_t count);

IH_END_DECLS

#endif
