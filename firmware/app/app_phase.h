/* app_phase - which frames the laser lit, seen from the frames themselves.
 *
 * A driver holds frames in flight, drops some and delivers others late, so that what was commanded
 * says little about the frame at hand. The dots do: of 144 rendered frames without laser (both rigs,
 * six kinds of scenes, half of them in sunlight) none had a single labelled dot, of as many lit ones
 * the poorest had 18. So a frame with APP_PHASE_SEEN_MIN labels is lit, whatever was commanded.
 *
 * In:    how many dots of a frame are labelled, and since how many frames the laser has been on.
 * Out:   lit: it counts. Dark: it shows the ambient light. Partial: some of it was exposed before the
 *        laser was switched; it is good for nothing.
 * Method: - Labels, and not much fewer than in the lit frame before it: lit. Much fewer, in a mode
 *          that switches: partial; but not twice in a row, then the scene has changed.
 *        - No labels, and the laser has been on for longer than frames stay in flight: lit, and
 *          nothing is within range.
 *        - No labels else: dark.
 *        So after any frame that was lost, late or came twice, the next one is judged right at once,
 *        or at the second try.
 */
#ifndef APP_PHASE_H
#define APP_PHASE_H

#include <stdbool.h>
#include <stdint.h>

/* As many labels show that the dots are there. */
#define APP_PHASE_SEEN_MIN 8
/* Max frames in flight: exposed before the laser was switched on, seen later. Drivers hold
 * 4 to 8 buffers. */
#define APP_PHASE_FLIGHT_MAX 8
/* A lit frame has at least 4/8 of the labels of the lit one before it, else it may be partial. */
#define APP_PHASE_PARTIAL_EIGHTHS 4

enum app_phase_verdict { APP_PHASE_LIT, APP_PHASE_DARK, APP_PHASE_PARTIAL };

struct app_phase {
    int32_t typical_count; /* labels of the last lit frame; 0: none yet */
    bool was_partial;      /* the frame before */
};

void app_phase_init(struct app_phase *phase);

/* switches: the mode turns the laser off and on. on_frames: frames since light was last wished for,
 * this one included; 0 while it is not. */
enum app_phase_verdict app_phase_judge(struct app_phase *phase, int32_t labelled_count,
                                       bool switches, int32_t on_frames);

#endif
