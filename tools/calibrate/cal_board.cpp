#include "cal_board.hpp"

#include <algorithm>
#include <cairo-pdf.h>
#include <cairo.h>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "cal_error.hpp"
#include "cal_pictures.hpp"
#include "tool_file.hpp"

namespace cal
{
/* The white that a printer leaves at the sheet's edges. */
static constexpr double margin_mm = 8.0;
static constexpr double marker_fraction = 0.8;
static constexpr int dictionary = cv::aruco::DICT_4X4_100;
static constexpr int markers_max = 100;
/* So many samples along each side of one of board_picture's. */
static constexpr int finer = 5;

cv::Point3d Board::corner_mm(int vertex) const
{
    int column = vertex % (columns - 1) + 1, row = vertex / (columns - 1) + 1, beyond = vertex - corner_count();
    if (beyond >= 0 && beyond < 2 * (columns + 1)) { /* the upper side, then the lower one */
        column = beyond % (columns + 1);
        row = beyond <= columns ? 0 : rows;
    } else if (beyond >= 0) { /* what is left of the two other ones */
        int side = beyond - 2 * (columns + 1);
        column = side % 2 == 0 ? 0 : columns;
        row = side / 2 + 1;
    }
    return {column * square_mm, row * square_mm, 0.0};
}

cv::Point2d Board::sheet_origin_mm() const
{
    return middle_mm() - cv::Point2d(0.5 * sheet_width_mm, 0.5 * sheet_height_mm);
}

/* The first markers of the dictionary alone: the fewer there are, the fewer are found where there is none. */
static cv::Ptr<cv::aruco::Dictionary> first_markers(int count)
{
    auto all = cv::aruco::getPredefinedDictionary(dictionary);
    return cv::makePtr<cv::aruco::Dictionary>(all->bytesList.rowRange(0, count).clone(), all->markerSize,
                                              all->maxCorrectionBits);
}

Board board_parse(const std::string &name)
{
    char kind[16];
    int columns, rows, length = 0;
    double square_mm;
    if (std::sscanf(name.c_str(), "%15[a-z]-%3dx%3d-%lf%n", kind, &columns, &rows, &square_mm, &length) != 4 ||
        name[static_cast<size_t>(length)] != '\0' ||
        (std::strcmp(kind, "charuco") != 0 && std::strcmp(kind, "chessboard") != 0))
        throw Error(name + ": must be like charuco-9x6-30 or chessboard-9x6-30 (squares across, down, mm)");
    if (columns < 4 || rows < 4 || !(square_mm >= 5.0) || columns * square_mm > sheet_width_mm - 2 * margin_mm ||
        rows * square_mm > sheet_height_mm - 2 * margin_mm)
        throw Error(name + ": must have at least 4x4 squares of at least 5 mm and fit into 281x194 mm");
    Board board{std::strcmp(kind, "charuco") == 0, columns, rows, square_mm, name, {}};
    if (board.charuco && columns * rows / 2 > markers_max)
        throw Error(name + ": has more than 100 white squares");
    if (board.charuco)
        board.markers = cv::aruco::CharucoBoard::create(columns, rows, static_cast<float>(square_mm),
                                                        static_cast<float>(marker_fraction * square_mm),
                                                        first_markers(columns * rows / 2));
    return board;
}

/* A square of the print, in bitmap pixels. */
static cv::Rect square_of(const Board &board, int px_per_mm, double x_mm, double y_mm, double side_mm)
{
    cv::Point2d sheet = board.sheet_origin_mm();
    int left = cvRound((x_mm - sheet.x) * px_per_mm), top = cvRound((y_mm - sheet.y) * px_per_mm);
    int right = cvRound((x_mm + side_mm - sheet.x) * px_per_mm);
    int bottom = cvRound((y_mm + side_mm - sheet.y) * px_per_mm);
    return {left, top, right - left, bottom - top};
}

static void draw_marker(const Board &board, int px_per_mm, int column, int row, int marker, cv::Mat &sheet)
{
    double side_mm = marker_fraction * board.square_mm, edge_mm = 0.5 * (board.square_mm - side_mm);
    cv::Rect position =
        square_of(board, px_per_mm, column * board.square_mm + edge_mm, row * board.square_mm + edge_mm, side_mm);
    cv::Mat drawn;
    cv::aruco::drawMarker(board.markers->dictionary, marker, board.markers->dictionary->markerSize + 2, drawn, 1);
    cv::resize(drawn, sheet(position), position.size(), 0.0, 0.0, cv::INTER_NEAREST);
}

cv::Mat board_bitmap(const Board &board, int px_per_mm)
{
    cv::Mat sheet(cvRound(sheet_height_mm * px_per_mm), cvRound(sheet_width_mm * px_per_mm), CV_8U, cv::Scalar(255));
    int marker = 0;
    for (int row = 0; row < board.rows; row++) {
        for (int column = 0; column < board.columns; column++) {
            if ((row + column) % 2 == 0)
                sheet(square_of(board, px_per_mm, column * board.square_mm, row * board.square_mm, board.square_mm)) =
                    cv::Scalar(0);
            else if (board.charuco)
                draw_marker(board, px_per_mm, column, row, marker++, sheet);
        }
    }
    return sheet;
}

cv::Mat board_picture(const Board &board, int px_per_mm)
{
    cv::Mat picture;
    cv::resize(board_bitmap(board, finer * px_per_mm), picture, {}, 1.0 / finer, 1.0 / finer, cv::INTER_AREA);
    return picture;
}

static constexpr double points_per_mm = 72.0 / 25.4;
/* Grey of the print for dark_albedo: a raster of half black, which spreads a little in the paper. */
static constexpr double dark_grey = 0.5;
static constexpr int bitmap_px_per_mm = 4;
/* Fine enough for every edge of a board to lie on a whole sample. */
static constexpr int area_px_per_mm = 20;
static constexpr double ruler_mm = 100.0;

static bool ends_with(const std::string &name, const char *end)
{
    std::string tail = end;
    return name.size() > tail.size() && name.compare(name.size() - tail.size(), tail.size(), tail) == 0;
}

static void write_bitmap(const Board &board, const std::string &path)
{
    cv::Mat sheet = board_picture(board, bitmap_px_per_mm), albedo;
    sheet.convertTo(albedo, CV_8U, white_albedo - dark_albedo, 255.0 * dark_albedo);
    picture_write(path, albedo);
}

/* All dark areas as rectangles: runs of dark samples in a row, continued downwards as long as they are the same. */
static void draw_areas(const cv::Mat &sheet, cairo_t *page)
{
    for (int row = 0; row < sheet.rows; row++) {
        for (int left = 0; left < sheet.cols; left++) {
            if (sheet.at<uchar>(row, left) != 0 || (left > 0 && sheet.at<uchar>(row, left - 1) == 0))
                continue;
            int right = left;
            while (right < sheet.cols && sheet.at<uchar>(row, right) == 0)
                right++;
            bool begun = row > 0 && sheet.at<uchar>(row - 1, left) == 0 && sheet.at<uchar>(row - 1, right - 1) == 0 &&
                         (left == 0 || sheet.at<uchar>(row - 1, left - 1) != 0) &&
                         (right == sheet.cols || sheet.at<uchar>(row - 1, right) != 0) &&
                         cv::countNonZero(sheet.row(row - 1).colRange(left, right)) == 0;
            if (begun)
                continue;
            int bottom = row;
            while (bottom < sheet.rows && cv::countNonZero(sheet.row(bottom).colRange(left, right)) == 0 &&
                   (left == 0 || sheet.at<uchar>(bottom, left - 1) != 0) &&
                   (right == sheet.cols || sheet.at<uchar>(bottom, right) != 0))
                bottom++;
            constexpr double mm = 1.0 / area_px_per_mm;
            cairo_rectangle(page, left * mm, row * mm, (right - left) * mm, (bottom - row) * mm);
        }
    }
    cairo_set_source_rgb(page, dark_grey, dark_grey, dark_grey);
    cairo_fill(page);
}

static void draw_ruler(const Board &board, cairo_t *page)
{
    /* As far from the sheet's edge, which printers leave white, as there is room below the board. */
    double below_mm = 0.5 * (sheet_height_mm - board.rows * board.square_mm);
    double left_mm = 10.0, y_mm = sheet_height_mm - std::clamp(below_mm - 4.0, 5.0, 10.0);
    cairo_set_source_rgb(page, 0.0, 0.0, 0.0);
    cairo_set_line_width(page, 0.15);
    for (int cm = 0; cm <= 10; cm++) {
        cairo_move_to(page, left_mm + 10.0 * cm, y_mm);
        cairo_line_to(page, left_mm + 10.0 * cm, y_mm - (cm % 10 == 0 ? 2.0 : 1.0));
    }
    cairo_move_to(page, left_mm, y_mm);
    cairo_line_to(page, left_mm + ruler_mm, y_mm);
    cairo_stroke(page);
    cairo_select_font_face(page, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(page, 2.6);
    cairo_move_to(page, left_mm + ruler_mm + 3.0, y_mm);
    cairo_show_text(page,
                    text("must measure 100 mm: print without scaling. isohead board %s", board.name.c_str()).c_str());
}

static cairo_status_t take(void *bytes, const unsigned char *data, unsigned int count)
{
    static_cast<std::string *>(bytes)->append(reinterpret_cast<const char *>(data), count);
    return CAIRO_STATUS_SUCCESS;
}

static void write_pdf(const Board &board, const std::string &path)
{
    std::string bytes;
    cairo_surface_t *surface = cairo_pdf_surface_create_for_stream(take, &bytes, sheet_width_mm * points_per_mm,
                                                                   sheet_height_mm * points_per_mm);
    cairo_t *page = cairo_create(surface);
    cairo_scale(page, points_per_mm, points_per_mm);
    draw_areas(board_bitmap(board, area_px_per_mm), page);
    draw_ruler(board, page);
    cairo_show_page(page);
    cairo_status_t status = cairo_status(page);
    cairo_destroy(page);
    cairo_surface_finish(surface);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (status != CAIRO_STATUS_SUCCESS)
        throw Error(path + ": " + cairo_status_to_string(status));
    tool::file_write(path, bytes);
}

bool board_prints(const std::string &path)
{
    return ends_with(path, ".pdf") || ends_with(path, ".pgm");
}

void board_print(const Board &board, const std::string &path)
{
    if (ends_with(path, ".pgm"))
        write_bitmap(board, path);
    else
        write_pdf(board, path);
}
} // namespace cal
