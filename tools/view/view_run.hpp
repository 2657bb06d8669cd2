/* view_run - what the command line asks for, from frames and traces to a file.
 */
#ifndef VIEW_RUN_HPP
#define VIEW_RUN_HPP

#include "view_options.hpp"

namespace view
{
/* False: something was left out, and standard error says what. Throws view::Error. */
bool view_run(const Options &options);
} // namespace view

#endif
