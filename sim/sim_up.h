/* sim_up - no heads where there is enough to be seen: are they found when another side is up?
 *
 * In:     a run over a directory. Its frames with 60 labels and more, and all depth images, have enough.
 * Out:    one line of advice on standard error with the "up" to enter in the rig file; the exit status stays.
 * Method: only when fewer than a tenth of at least 5 such frames have a head: up to SIM_UP_SAMPLES of them, evenly spread,
 *         are read again and looked at one by one, without tracks, as if the camera hung otherwise: each side of the picture
 *         up, and level or looking up or down by 30 or 45 degrees. The up with the most heads, then the most probable ones,
 *         is named; or the best one that has the picture's top up, where its heads are three quarters as probable in sum.
 *         At least half of the sample, and at least 5 frames, must have a head, and these heads must move: a thing in an
 *         empty room may look like a head from another side.
 * Cost:   nothing for a run with heads; else at most half of 20 times the sample and a bit, in frames.
 */
#ifndef SIM_UP_H
#define SIM_UP_H

#include <stddef.h>
#include <stdint.h>

#include "isohead.h"
#include "replay/hal_replay.h"
#include "sim_cloud.h"
#include "sim_report.h"

#define SIM_UP_SAMPLES 12

struct sim_up {
    int32_t enough_count, head_count; /* frames with enough to be seen; those of them with a head */
    int32_t sample_count;
    size_t sample[SIM_UP_SAMPLES]; /* indices of such frames in their directory */
    int32_t step;                  /* every so many of them; 0 is 1 */
};

/* What a directory's frames are read with. */
struct sim_up_source {
    struct hal_replay *replay; /* its next frame changes */
    struct sim_cloud *cloud;
    struct isohead *head;  /* changes */
    const char *dir, *rig; /* as they are called in the advice */
};

/* index: of the frame that head has the results of. */
void sim_up_frame(struct sim_up *up, const struct isohead *head, size_t index);

/* After the directory's last frame. */
void sim_up_report(const struct sim_up *up, const struct sim_up_source *source,
                   struct sim_report *report);

#endif
