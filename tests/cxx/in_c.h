/* in_c - isohead as a C program has it, for the C++ program to compare with. */
#ifndef IN_C_H
#define IN_C_H

#include <stddef.h>

#include "isohead.h"

IH_BEGIN_DECLS

/* Of struct isohead. */
size_t in_c_size(void);
size_t in_c_alignment(void);
size_t in_c_offset_of_result(void);

/* The result of one frame. */
enum ih_err in_c_find(const struct ih_calibration *calibration, const struct ih_frame *frame,
                      struct ih_result *result);

IH_END_DECLS

#endif
