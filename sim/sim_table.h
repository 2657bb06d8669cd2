/* sim_table - results for people, in 80 columns: a line per frame, then the tables.
 *
 * Table 1 is the paper's (section 4), one row per frames directory and one more for its frames
 * without a head, plus how often the selected head was right and how far off it was. Where the
 * truth has dots, a second table says how well they were found, labelled and measured.
 */
#ifndef SIM_TABLE_H
#define SIM_TABLE_H

#include <stdio.h>

#include "hal.h"
#include "sim_score.h"

/* A word for how a selection went. */
const char *sim_table_outcome(enum sim_outcome outcome);

/* Above the lines of a directory. */
void sim_table_title(FILE *file, const char *path);

void sim_table_frame(FILE *file, const struct hal_frame *frame, const struct isohead *head,
                     const struct sim_verdict *verdict);
/* How the rig has moved; nothing for a range rig and with the paper's method alone. */
void sim_table_rig(FILE *file, const struct isohead *head);
void sim_table_error(FILE *file, const char *name, const char *error);

/* Heading, then a row per directory and last the sum, each for Table 1 and for the dots. Rows
 * without frames or dots to score print nothing. */
void sim_table_heading(FILE *file);
void sim_table_row(FILE *file, const char *label, struct sim_score *score);
void sim_table_dots_heading(FILE *file);
void sim_table_dots_row(FILE *file, const char *label, struct sim_score *score);

#endif
