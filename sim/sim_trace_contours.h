/* sim_trace_contours - the contours of a trace, level by level, and of each the arcs that support nests.
 *
 * Key:   cuts, a list of levels; a contour's part names the nest and the slice that it supports, and is an
 *        arc: its chord leads from the last point back to the first.
 * Method: the core keeps neither the contours nor where an arc is, only the arc's ellipse. So every level
 *        is traced again, and the arcs are searched for again: that must give the same ellipse. The arc
 *        is the stretch of the core's resampled contour with that ellipse's area and centre.
 * Cost:  that of the contours and of the core's search, and at most 56 x 56 sums an arc.
 */
#ifndef SIM_TRACE_CONTOURS_H
#define SIM_TRACE_CONTOURS_H

#include "app_write.h"
#include "isohead.h"

/* Uses head->scratch. */
void sim_trace_contours(struct app_write *write, struct isohead *head);

#endif
