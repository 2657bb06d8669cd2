/* In place of sim_page.c where what it needs was not there when host_sim was built. */
#include "sim_page.h"

/* The build says what was missing. */
#ifndef SIM_PAGE_REASON
#define SIM_PAGE_REASON "it was built without"
#endif

bool sim_page_open(struct sim_page *page, const char *path, struct hal_error *error)
{
    (void)page;
    (void)path;
    return hal_fail(error, "this host_sim has no report page: " SIM_PAGE_REASON);
}

void sim_page_run(struct sim_page *page, const struct sim_options *options,
                  struct sim_report *report)
{
    (void)page;
    (void)options;
    (void)report;
}

void sim_page_dir(struct sim_page *page, const struct sim_dir *dir, const char *rig,
                  const struct isohead *head)
{
    (void)page;
    (void)dir;
    (void)rig;
    (void)head;
}

bool sim_page_frame(struct sim_page *page, const struct sim_page_frame *frame,
                    struct hal_error *error)
{
    (void)page;
    (void)frame;
    (void)error;
    return true;
}

void sim_page_lost(struct sim_page *page, const struct app_record *record)
{
    (void)page;
    (void)record;
}

void sim_page_row(struct sim_page *page, const char *label, struct sim_score *score)
{
    (void)page;
    (void)label;
    (void)score;
}

bool sim_page_close(struct sim_page *page, struct hal_error *error)
{
    (void)page;
    (void)error;
    return true;
}
