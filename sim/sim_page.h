/* sim_page - the report page: one HTML file with everything in it (docs/report.md).
 *
 * Out:   sim/report/page.html with its style, its program and the libraries, which the build folds into
 *        this one, and in their midst the data, as elements that the browser does not run:
 *          class run     JSON: version, command line
 *          class other   JSON: a record of the run that this one is compared with
 *          class dir     JSON: a directory's rig and the limits that scores are held against
 *          class frame   JSON: the record as host_sim --json writes it, the truth, the verdict
 *          class trace   base64 of zlib of what host_sim --trace writes of the frame
 *          class image   base64 of a JPEG
 *          class row     JSON: a row of Table 1
 *        In JSON every '<' is \u003c: no name ends an element or begins one.
 * Size:  1.2 MB, and 50 to 120 kB a frame.
 * Error: written beside its place under another name, which it gets when it is whole: a disk that is full,
 *        a signal that ends the program, or a run without any frame leaves no page, or the old one.
 */
#ifndef SIM_PAGE_H
#define SIM_PAGE_H

#include <stddef.h>
#include <stdio.h>

#include "app_record.h"
#include "sim_dirs.h"
#include "sim_image.h"
#include "sim_options.h"
#include "sim_score.h"

struct sim_page {
    FILE *file; /* NULL: no page is wanted */
    const char *path;
    char *part_path; /* its name until it is whole */
    char *text;      /* of a trace */
    size_t length, capacity;
    struct sim_image image;
    size_t dir_count, frame_count; /* so far */
    int error_number;              /* of the first write that failed */
};

/* The page without its data, as the build folded it (sim/report/fold.cmake): before them and after them. */
extern const unsigned char sim_page_head[];
extern const size_t sim_page_head_size;
extern const unsigned char sim_page_tail[];
extern const size_t sim_page_tail_size;

/* What there is to say of a frame. */
struct sim_page_frame {
    const struct hal_frame *frame;
    const struct ih_frame *view; /* what the core was given */
    struct isohead *head;        /* its scratch is used */
    const struct app_record *record;
    const struct sim_truth_frame *truth; /* NULL: none */
    const struct sim_verdict *verdict;
};

/* False: *error says why, and there is nothing to close. */
bool sim_page_open(struct sim_page *page, const char *path, struct hal_error *error);

/* How the run was started, and the records of --against. What is wrong in them goes to the report. */
void sim_page_run(struct sim_page *page, const struct sim_options *options,
                  struct sim_report *report);

/* The directory that the frames after it are of; rig_path: its file. */
void sim_page_dir(struct sim_page *page, const struct sim_dir *dir, const char *rig_path,
                  const struct isohead *head);

/* False: *error, and the frame has no image; what cannot be written shows on closing. */
bool sim_page_frame(struct sim_page *page, const struct sim_page_frame *frame,
                    struct hal_error *error);

/* A frame that could not be processed, as its record says. */
void sim_page_lost(struct sim_page *page, const struct app_record *record);

/* A row of Table 1: of a directory, or of all. */
void sim_page_row(struct sim_page *page, const char *label, struct sim_score *score);

/* Only a page that is whole gets its name. False: *error. */
bool sim_page_close(struct sim_page *page, struct hal_error *error);

#endif
