/* cal_guide - helps somebody to take the pictures: which of them are good, and what is still missing.
 */
#ifndef CAL_GUIDE_HPP
#define CAL_GUIDE_HPP

#include "cal_options.hpp"

namespace cal
{
/* Looks at a directory. True: nothing is missing. Throws cal::Error. */
bool guide_directory(const Options &options);

/* Takes pictures with a camera into the directory until nothing is missing, those that are there counted: each time the
 * board is found, sharp, held still and shown in a new way, one without the laser; then, when the user has switched it on
 * and pressed Enter, one with it, in which there must be dots and the board must not have moved. Of a pair both
 * pictures are written or none, unless the program is killed between the two. True: nothing is missing. Throws cal::Error. */
bool guide_camera(const Options &options);
} // namespace cal

#endif
