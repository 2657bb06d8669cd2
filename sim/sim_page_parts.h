/* sim_page_parts - the report page without its data, as the build folded it (sim/report/fold.cmake). */
#ifndef SIM_PAGE_PARTS_H
#define SIM_PAGE_PARTS_H

#include <stddef.h>

/* Before the data and after it. */
extern const unsigned char sim_page_head[];
extern const size_t sim_page_head_size;
extern const unsigned char sim_page_tail[];
extern const size_t sim_page_tail_size;

#endif
