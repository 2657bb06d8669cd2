#include "cal_refine.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_pictures.hpp"

namespace cal
{
cv::Matx33d draw_map(const Board &board, const cv::Vec3d &rvec, const cv::Vec3d &shift)
{
    cv::Matx33d rotation;
    cv::Point2d sheet = board.sheet_origin_mm();
    double scale = draw_px_per_mm;
    cv::Rodrigues(rvec, rotation);
    cv::Matx33d from_board(rotation(0, 0), rotation(0, 1), shift[0], rotation(1, 0), rotation(1, 1), shift[1],
                           rotation(2, 0), rotation(2, 1), shift[2]);
    cv::Matx33d to_print(scale, 0.0, -scale * sheet.x - 0.5, 0.0, scale, -scale * sheet.y - 0.5, 0.0, 0.0, 1.0);
    return to_print * from_board.inv();
}

cv::Mat draw_tangents(cv::Size size, const cv::Mat &camera, const cv::Mat &distortion)
{
    cv::Mat px(size, CV_64FC2), tangents;
    for (int v = 0; v < size.height; v++) {
        for (int u = 0; u < size.width; u++)
            px.at<cv::Vec2d>(v, u) = {static_cast<double>(u), static_cast<double>(v)};
    }
    cv::undistortPoints(px.reshape(2, 1), tangents, camera, distortion, cv::noArray(), cv::noArray(),
                        {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-9});
    return tangents.reshape(2, size.height);
}

Sight draw_sight(const cv::Mat &tangents, cv::Point2d px)
{
    int u = std::clamp(cvFloor(px.x), 0, tangents.cols - 2), v = std::clamp(cvFloor(px.y), 0, tangents.rows - 2);
    cv::Vec2d here = tangents.at<cv::Vec2d>(v, u), right = tangents.at<cv::Vec2d>(v, u + 1) - here;
    cv::Vec2d down = tangents.at<cv::Vec2d>(v + 1, u) - here;
    return {here + (px.x - u) * right + (px.y - v) * down, right, down};
}

bool draw_on_sheet(const cv::Mat &print, int left, int top)
{
    return left >= 0 && top >= 0 && left + 1 < print.cols && top + 1 < print.rows;
}

double draw_sample(const cv::Mat &print, const cv::Vec3d &at)
{
    double x = at[0] / at[2], y = at[1] / at[2];
    int left = cvFloor(x), top = cvFloor(y);
    if (!draw_on_sheet(print, left, top))
        return 1.0;
    double fx = x - left, fy = y - top;
    const uchar *upper = print.ptr<uchar>(top) + left, *lower = print.ptr<uchar>(top + 1) + left;
    return ((1.0 - fy) * ((1.0 - fx) * upper[0] + fx * upper[1]) + fy * ((1.0 - fx) * lower[0] + fx * lower[1])) /
           255.0;
}

/* Half side of the patch in squares, and its bounds. */
static constexpr double patch_fraction = 0.48;
static constexpr int patch_min_px = 4, patch_max_px = 30, blur_reach_px = 3;
static constexpr int sub_samples_min = 3, sub_samples_max = 6; /* about one for each sample of the print */
static constexpr int steps = 4;
static constexpr double moved_max_px = 2.5, sigma_floor_px = 0.002;
/* The residual may be this fraction of the contrast. */
static constexpr double miss_max = 0.12, contrast_min_grey = 12.0;
/* Pixels at the sensor's limit are not used, nor what is so many times the usual residual (a Gaussian's, from the mean
 * absolute one) above the print, at least so many grey values: dots of the laser. So much of the patch must be left. */
static constexpr double saturated_grey = 248.0, extra_times = 3.0, extra_min_grey = 4.0, used_fraction = 0.6;
/* Of a patch at the picture's or the sheet's border so much must be there. */
static constexpr double visible_fraction = 0.35;
static constexpr double mean_to_sigma = 1.2533;
static constexpr int passes = 4;
/* An edge's rise over its steepest slope is this many standard deviations of its blur. */
static constexpr double edge_sigmas = 2.5066, pixel_sigma_px = 0.29, blur_min_px = 0.4;

/* In this order: gain; background, its slopes and curves (a lamp's mirror image is a hill); how much softer the picture is
 * than the drawing, without which a patch that is not the same on both sides is pushed aside; the gain's slopes, because
 * light that fades across the sheet pushes corners aside, too; shift. */
static constexpr int unknowns = 12, shift_u = 10, shift_v = 11;
using Unknowns = cv::Matx<double, unknowns, 1>;

/* What draws the print as the camera sees it. */
struct Drawing {
    const cv::Mat &print, &tangents;
    cv::Matx33d map; /* draw_map */
    double blur_px = 0.0;
    int sub_samples = 1; /* along each side of a pixel */
};

/* 0 dark to 1 white, and CV_8U: what nothing beyond the sheet had a part in. */
struct Drawn {
    cv::Mat light, sheet;
};

/* Pixels from -half to half around `middle_px` (and a border for the blur), all moved by `moved_px`. */
static Drawn draw_patch(const Drawing &drawing, cv::Point middle_px, cv::Point2d moved_px, int half)
{
    int side = 2 * (half + blur_reach_px) + 1, reach = 2 * blur_reach_px + 1;
    cv::Mat sharp(side, side, CV_64F), sheet(side, side, CV_8U);
    Drawn drawn;
    int parts = drawing.sub_samples;
    cv::Point2d first = cv::Point2d(middle_px) - moved_px - cv::Point2d(half + blur_reach_px, half + blur_reach_px);
    for (int row = 0; row < side; row++) {
        for (int column = 0; column < side; column++) {
            Sight sight = draw_sight(drawing.tangents, first + cv::Point2d(column, row));
            double sum = 0.0;
            for (int i = 0; i < parts * parts; i++) {
                double right = (i % parts + 0.5) / parts - 0.5, down = (i / parts + 0.5) / parts - 0.5;
                sum += draw_sample(drawing.print, drawing.map * sight.beside(right, down));
            }
            cv::Vec3d middle = drawing.map * sight.beside(0.0, 0.0);
            sharp.at<double>(row, column) = sum / (parts * parts);
            sheet.at<uchar>(row, column) =
                draw_on_sheet(drawing.print, cvFloor(middle[0] / middle[2]), cvFloor(middle[1] / middle[2]));
        }
    }
    cv::GaussianBlur(sharp, drawn.light, {reach, reach}, drawing.blur_px);
    cv::erode(sheet, drawn.sheet, cv::Mat::ones(reach, reach, CV_8U));
    return drawn;
}

/* What a pixel of the patch adds to the equations. */
struct Pixel {
    Unknowns terms;
    double grey;
    bool used;
};

/* Those of the patch that are in the picture and on the sheet. */
static std::vector<Pixel> list_pixels(const cv::Mat &grey, const Drawn &drawn, cv::Point middle_px, int half)
{
    std::vector<Pixel> pixels;
    cv::Rect frame(0, 0, grey.cols, grey.rows);
    const cv::Mat &light = drawn.light;
    for (int dv = -half; dv <= half; dv++) {
        for (int du = -half; du <= half; du++) {
            cv::Point at = middle_px + cv::Point(du, dv);
            int row = dv + half + blur_reach_px, column = du + half + blur_reach_px;
            if (!frame.contains(at) || drawn.sheet.at<uchar>(row, column) == 0)
                continue;
            double slope_u = 0.5 * (light.at<double>(row, column + 1) - light.at<double>(row, column - 1));
            double slope_v = 0.5 * (light.at<double>(row + 1, column) - light.at<double>(row - 1, column));
            double here = light.at<double>(row, column);
            double soft = light.at<double>(row, column + 1) + light.at<double>(row, column - 1) +
                          light.at<double>(row + 1, column) + light.at<double>(row - 1, column) - 4.0 * here;
            double x = static_cast<double>(du) / half, y = static_cast<double>(dv) / half;
            double seen = static_cast<double>(grey.at<float>(at));
            pixels.push_back({{here, 1.0, x, y, x * x, x * y, y * y, soft, here * x, here * y, -slope_u, -slope_v},
                              seen,
                              seen < saturated_grey});
        }
    }
    return pixels;
}

/* Without what is much lighter than it should be; false: nothing is. */
static bool drop_lit(std::vector<Pixel> &pixels, const Unknowns &found)
{
    double sum = 0.0;
    int used = 0;
    bool changed = false;
    for (const Pixel &pixel : pixels) {
        sum += pixel.used ? std::abs(pixel.grey - pixel.terms.dot(found)) : 0.0;
        used += pixel.used;
    }
    double limit = std::max(extra_times * mean_to_sigma * sum / std::max(1, used), extra_min_grey);
    for (Pixel &pixel : pixels) {
        bool lit = pixel.used && pixel.grey - pixel.terms.dot(found) > limit;
        pixel.used = pixel.used && !lit;
        changed = changed || lit;
    }
    return changed;
}

/* One step of least squares: gain, background and how far the corner is from where it was drawn (shift times gain: the
 * equations are linear in that). */
struct Match {
    Unknowns found;
    double miss = 0.0;     /* the residual, as a fraction of the gain */
    double sigma_px = 0.0; /* of the shift, one component */
};

static bool match(std::vector<Pixel> &pixels, Match &result)
{
    for (int pass = 0; pass < passes; pass++) {
        cv::Matx<double, unknowns, unknowns> normal = cv::Matx<double, unknowns, unknowns>::zeros();
        Unknowns right = Unknowns::zeros();
        double square_sum = 0.0;
        int used = 0;
        for (const Pixel &pixel : pixels) {
            if (!pixel.used)
                continue;
            normal += pixel.terms * pixel.terms.t();
            right += pixel.terms * pixel.grey;
            square_sum += pixel.grey * pixel.grey;
            used++;
        }
        bool solved = false;
        cv::Matx<double, unknowns, unknowns> inverse = normal.inv(cv::DECOMP_CHOLESKY, &solved);
        if (used < used_fraction * static_cast<double>(pixels.size()) || !solved)
            return false;
        result.found = inverse * right;
        result.miss =
            std::sqrt(std::max(0.0, square_sum - right.dot(result.found)) / (used - unknowns)) / result.found(0);
        result.sigma_px = result.miss * std::sqrt(0.5 * (inverse(shift_u, shift_u) + inverse(shift_v, shift_v)));
        if (!drop_lit(pixels, result.found))
            break;
    }
    return result.found(0) >= contrast_min_grey;
}

static bool refine_one(const Drawing &drawing, const cv::Mat &grey, int half, cv::Point2d &corner_px, double &sigma_px,
                       double &dark_fraction)
{
    cv::Point2d start = corner_px;
    Match result{{}, 1.0, 0.0};
    for (int step = 0; step < steps; step++) {
        cv::Point middle(cvRound(corner_px.x), cvRound(corner_px.y));
        std::vector<Pixel> pixels =
            list_pixels(grey, draw_patch(drawing, middle, corner_px - start, half), middle, half);
        double whole = (2.0 * half + 1.0) * (2.0 * half + 1.0);
        if (static_cast<double>(pixels.size()) < visible_fraction * whole || !match(pixels, result))
            return false;
        cv::Point2d move(result.found(shift_u), result.found(shift_v));
        move *= 1.0 / result.found(0);
        corner_px += move * std::min(1.0, 1.0 / std::max(1e-9, cv::norm(move)));
        if (cv::norm(corner_px - start) > moved_max_px)
            return false;
        if (cv::norm(move) < 0.003)
            break;
    }
    double ground = std::max(0.0, result.found(1) - black_grey);
    dark_fraction = ground / (ground + result.found(0));
    sigma_px = std::max(result.sigma_px, sigma_floor_px);
    return result.miss < miss_max;
}

/* The blur of the picture, by its edges' width. */
static double blur_of(double edge_px)
{
    double sigma_px = edge_px / edge_sigmas, square = sigma_px * sigma_px - pixel_sigma_px * pixel_sigma_px;
    return std::sqrt(std::max(blur_min_px * blur_min_px, square));
}

void corners_refine(const Board &board, const cv::Mat &print, const cv::Mat &tangents, const cv::Mat &grey,
                    const cv::Mat &camera, const cv::Mat &distortion, Corners &corners)
{
    cv::Vec3d rvec, shift;
    Corners refined;
    refined.edge_px = corners.edge_px;
    if (!cv::solvePnP(corners.positions_mm(board), corners.px, camera, distortion, rvec, shift))
        return;
    std::vector<cv::Point3d> positions;
    std::vector<cv::Point2d> expected;
    double half_square = 0.5 * board.square_mm;
    for (int id = 0; id < board.vertex_count(); id++) {
        positions.push_back(board.corner_mm(id));
        positions.push_back(positions.back() + cv::Point3d(half_square, 0.0, 0.0));
        positions.push_back(positions[positions.size() - 2] + cv::Point3d(0.0, half_square, 0.0));
    }
    cv::projectPoints(positions, rvec, shift, camera, distortion, expected);
    Drawing drawing{print, tangents, draw_map(board, rvec, shift), blur_of(corners.edge_px), sub_samples_max};
    for (int id = 0; id < board.vertex_count(); id++) {
        const cv::Point2d *seen = &expected[3 * static_cast<size_t>(id)];
        double shorter_px = std::min(cv::norm(seen[1] - seen[0]), cv::norm(seen[2] - seen[0]));
        int half = std::clamp(cvRound(2.0 * patch_fraction * shorter_px), patch_min_px, patch_max_px);
        drawing.sub_samples =
            std::clamp(cvCeil(half_square * draw_px_per_mm / shorter_px), sub_samples_min, sub_samples_max);
        cv::Point2d corner_px = seen[0];
        double sigma_px, dark_fraction;
        if (cv::Rect2d(0.0, 0.0, grey.cols, grey.rows).contains(corner_px) &&
            refine_one(drawing, grey, half, corner_px, sigma_px, dark_fraction)) {
            refined.ids.push_back(id);
            refined.px.emplace_back(corner_px);
            refined.sigma_px.push_back(sigma_px);
            refined.dark_fraction.push_back(dark_fraction);
        }
    }
    corners = refined;
}
} // namespace cal
