/* cal_report - what a calibration came to, as one HTML file with its pictures in it.
 */
#ifndef CAL_REPORT_HPP
#define CAL_REPORT_HPP

#include "cal_solve.hpp"

namespace cal
{
/* Throws cal::Error. */
void report_write(const std::string &path, const Result &result);
} // namespace cal

#endif
