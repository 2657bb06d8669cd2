/* cal_board - the printed board: a chessboard with or without ArUco markers in its white squares, in the middle of a
 * sheet of A4 that lies across. Units are mm on the sheet unless a name says otherwise.
 *
 * The board's frame: origin where the chessboard's top left square begins, X right, Y down, Z away from who looks at
 * it. Inner corner k is at ((k % (columns - 1) + 1) square, (k / (columns - 1) + 1) square, 0).
 * The dark squares are grey, not black: the laser's dots must show on them too.
 *
 * On paper, by the file's name: .pdf is a sheet of A4 in true size, drawn as areas, with a ruler of 100 mm to check the
 * printer by; .pgm is the same sheet without the ruler, 4 samples to the mm, 255 for an albedo of 1: what tools/render
 * shows.
 */
#ifndef CAL_BOARD_HPP
#define CAL_BOARD_HPP

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <string>

namespace cal
{
constexpr double sheet_width_mm = 297.0, sheet_height_mm = 210.0;
/* How much light white and dark of the print send back. */
constexpr double white_albedo = 0.9, dark_albedo = 0.3;

struct Board {
    bool charuco = true;
    int columns = 0, rows = 0; /* squares */
    double square_mm = 0.0;
    std::string name;                         /* as it was given */
    cv::Ptr<cv::aruco::CharucoBoard> markers; /* ChArUco only */

    int corner_count() const
    {
        return (columns - 1) * (rows - 1);
    }
    /* Corners and those on the pattern's outline, which are counted on. */
    int vertex_count() const
    {
        return corner_count() + 2 * (columns + rows);
    }
    cv::Point3d corner_mm(int vertex) const;
    cv::Point2d middle_mm() const
    {
        return {0.5 * columns * square_mm, 0.5 * rows * square_mm};
    }
    /* Corner of the sheet, in the board's frame. */
    cv::Point2d sheet_origin_mm() const;
};

/* "charuco-9x6-30" or "chessboard-9x6-30": squares across, squares down, mm of a square's side. Throws cal::Error. */
Board board_parse(const std::string &name);

/* The whole sheet, 0 dark and 255 white, as it would be with this resolution. */
cv::Mat board_bitmap(const Board &board, int px_per_mm);

/* The same with greys where an edge lies within a sample: edges are where they are printed, to 0.025 mm at 4 px/mm. */
cv::Mat board_picture(const Board &board, int px_per_mm);

/* Whether the file's name ends in one of these. */
bool board_prints(const std::string &path);

/* For such a name. Throws cal::Error. */
void board_print(const Board &board, const std::string &path);
} // namespace cal

#endif
