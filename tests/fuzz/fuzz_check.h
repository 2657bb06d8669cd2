/* fuzz_check - what holds of every stage's output, whatever its input was: counts within their
 * tables, indices that point at something, parts that add up to the whole, numbers within what the
 * stage's header says. A violation aborts the process, which an engine takes for a failure. */
#ifndef FUZZ_CHECK_H
#define FUZZ_CHECK_H

#include "isohead.h"

#include "fuzz.h"

void fuzz_check_dots(const struct ih_dots *dots, int32_t width, int32_t height);
void fuzz_check_labels(const struct ih_labels *labels, const struct ih_dots *dots,
                       const struct ih_rig *rig, const struct ih_labels_params *params);
void fuzz_check_windows(const struct ih_windows *windows, const struct ih_rig *rig);
void fuzz_check_points(const struct ih_points *points, const struct ih_rig *rig);
void fuzz_check_samples(const struct ih_samples *samples, const struct ih_points *points);
void fuzz_check_surface(const struct ih_surface *surface, const struct ih_samples *samples);
void fuzz_check_contours(const struct ih_contours *contours);
void fuzz_check_hypotheses(const struct ih_nests *nests, const struct ih_surface *surface,
                           const struct ih_nests_params *params);
void fuzz_check_heads(const struct ih_hypotheses *hypotheses, const struct ih_nests *nests,
                      const struct ih_samples *samples);
/* After ih_detections_add, before the tracks. */
void fuzz_check_detections(const struct ih_detections *detections);
void fuzz_check_tracks(const struct ih_tracks *tracks, const struct ih_detections *detections,
                       const struct ih_predicted *predicted);
/* What a track's position is known to at worst (ih_kalman.h). */
#define FUZZ_SIGMA_MAX_MM 500

void fuzz_check_result(const struct ih_result *result, int32_t sigma_max_mm);

/* All of a core after isohead_frame. */
void fuzz_check_core(const struct isohead *core);

/* An output of nothing, as after a frame that was refused. */
void fuzz_check_empty(const struct isohead *core);

/* The same outputs, stage by stage. */
void fuzz_check_same(const struct isohead *a, const struct isohead *b);

#endif
