#include "cal_print.hpp"

#include <algorithm>
#include <cairo-pdf.h>
#include <cairo.h>

#include "cal_error.hpp"
#include "cal_pictures.hpp"
#include "tool_file.hpp"

namespace cal
{
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
