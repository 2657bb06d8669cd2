/* view_error - the tools' errors (tools/common/tool_error.hpp) by this folder's name.
 */
#ifndef VIEW_ERROR_HPP
#define VIEW_ERROR_HPP

#include "tool_error.hpp"

namespace view
{
using tool::Error;
using tool::text;
} // namespace view

#endif
