/* cal_print - the board on paper.
 * By the file's name: .pdf is a sheet of A4 in true size, drawn as areas, with a ruler of 100 mm to check the printer
 * by; .pgm is the same sheet without the ruler, 4 samples to the mm, 255 for an albedo of 1: what tools/render shows.
 */
#ifndef CAL_PRINT_HPP
#define CAL_PRINT_HPP

#include "cal_board.hpp"

namespace cal
{
/* Whether the file's name ends in one of these. */
bool board_prints(const std::string &path);

/* For such a name. Throws cal::Error. */
void board_print(const Board &board, const std::string &path);
} // namespace cal

#endif
