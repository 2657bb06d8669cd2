/* view_reasons - in words: why a hypothesis was accepted or rejected (the paper's section 3.3), and what the whole
 * method says.
 */
#ifndef VIEW_REASONS_HPP
#define VIEW_REASONS_HPP

#include "view_trace.hpp"

namespace view
{
/* The verdict, then each measured value with its limits: all of an accepted one, of a rejected one those of the test
 * that it failed. */
std::vector<std::string> reason_lines(const Hypothesis &hypothesis, const Limits &limits);

/* "head at 691 mm, 99.6 % sure" .. */
std::string result_words(const Trace &trace);
} // namespace view

#endif
