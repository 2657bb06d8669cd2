/* cal_error - the tools' errors (tools/common/tool_error.hpp) by this folder's name.
 */
#ifndef CAL_ERROR_HPP
#define CAL_ERROR_HPP

#include "tool_error.hpp"

namespace cal
{
using tool::Error;
using tool::text;
} // namespace cal

#endif
