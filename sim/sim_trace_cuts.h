/* sim_trace_cuts - the surface's cuts of a trace: contours, and of each its parts that support nests.
 *
 * Key:   cuts, a list of levels; a contour's part names the nest and the slice that it supports, and is an
 *        arc: its chord leads from the last point back to the first.
 * Way:   the core keeps neither the cuts nor where a part is, only the part's ellipse. So every level is
 *        cut once more, and the parts are searched for once more: that must give the same ellipse; of
 *        the core's resampled contour the stretch with that ellipse's area and centre is the part.
 * Cost:  that of the cuts and of the core's search, and at most 56 x 56 sums a part.
 */
#ifndef SIM_TRACE_CUTS_H
#define SIM_TRACE_CUTS_H

#include "app_write.h"
#include "isohead.h"

/* Uses head->scratch. */
void sim_trace_cuts(struct app_write *write, struct isohead *head);

#endif
