#include "cal_bundle.hpp"

#include <opencv2/calib3d.hpp>

#include "cal_error.hpp"

namespace cal
{
static constexpr int camera_terms = 9, pose_terms = 6, lens_terms = 5;
static constexpr int steps = 12;
static constexpr double small_step = 1e-4; /* of the parameters' standard deviations */

using CameraTerms = cv::Matx<double, camera_terms, 1>;
using PoseTerms = cv::Matx<double, pose_terms, 1>;

/* One picture's part of the normal equations. */
struct Block {
    View *view = nullptr;
    cv::Matx<double, camera_terms, camera_terms> camera = cv::Matx<double, camera_terms, camera_terms>::zeros();
    cv::Matx<double, pose_terms, pose_terms> pose = cv::Matx<double, pose_terms, pose_terms>::zeros();
    cv::Matx<double, camera_terms, pose_terms> mixed = cv::Matx<double, camera_terms, pose_terms>::zeros();
    CameraTerms camera_right = CameraTerms::zeros();
    PoseTerms pose_right = PoseTerms::zeros();
    double square_sum = 0.0, weighted_sum = 0.0; /* of the residuals, px^2; of those in standard deviations */
};

/* A row of cv::projectPoints' derivatives: rotation, translation, focal lengths, centre, lens. */
static void add_row(const cv::Mat &slopes, int row, double miss_px, double weight, const Camera &camera, Block &block)
{
    const double *slope = slopes.ptr<double>(row);
    CameraTerms by_camera;
    PoseTerms by_pose;
    for (int i = 0; i < pose_terms; i++)
        by_pose(i) = slope[i];
    for (int i = 0; i < camera_terms; i++)
        by_camera(i) = i == camera_terms - 1 && !camera.third_radial ? 0.0 : slope[pose_terms + i];
    block.camera += weight * (by_camera * by_camera.t());
    block.pose += weight * (by_pose * by_pose.t());
    block.mixed += weight * (by_camera * by_pose.t());
    block.camera_right += by_camera * (weight * miss_px);
    block.pose_right += by_pose * (weight * miss_px);
    block.square_sum += miss_px * miss_px;
    block.weighted_sum += weight * miss_px * miss_px;
}

static Block block_of(const Board &board, const Camera &camera, View &view)
{
    Block block;
    std::vector<cv::Point3d> positions;
    std::vector<cv::Point2d> expected;
    cv::Mat slopes;
    block.view = &view;
    for (int id : view.corners.ids)
        positions.push_back(board.corner_mm(id));
    cv::projectPoints(positions, view.rvec, view.shift, camera.matrix, camera.distortion, expected, slopes);
    for (size_t i = 0; i < expected.size(); i++) {
        cv::Point2d miss = cv::Point2d(view.corners.px[i]) - expected[i];
        double weight = 1.0 / (view.corners.sigma_px[i] * view.corners.sigma_px[i]);
        add_row(slopes, 2 * static_cast<int>(i), miss.x, weight, camera, block);
        add_row(slopes, 2 * static_cast<int>(i) + 1, miss.y, weight, camera, block);
    }
    return block;
}

static std::vector<Block> list_blocks(const Board &board, const Camera &camera, std::vector<View> &views)
{
    std::vector<Block> blocks;
    for (View &view : views) {
        if (view.good())
            blocks.push_back(block_of(board, camera, view));
    }
    return blocks;
}

/* Corners miss by more than their patches say (a flat sheet is not): by how much, each picture's residuals show. */
static double weight_of(const Block &block)
{
    double free = 2.0 * static_cast<double>(block.view->corners.ids.size()) - pose_terms;
    return 1.0 / std::max(block.weighted_sum / free, 1.0);
}

/* The camera's change and its covariance once every pose has followed it. */
static cv::Matx<double, camera_terms, camera_terms> solve(const std::vector<Block> &blocks, const Camera &camera,
                                                          CameraTerms &change)
{
    auto normal = cv::Matx<double, camera_terms, camera_terms>::zeros();
    CameraTerms right = CameraTerms::zeros();
    for (const Block &block : blocks) {
        cv::Matx<double, camera_terms, pose_terms> back = block.mixed * block.pose.inv();
        double weight = weight_of(block);
        normal += weight * (block.camera - back * block.mixed.t());
        right += weight * (block.camera_right - back * block.pose_right);
    }
    if (!camera.third_radial)
        normal(camera_terms - 1, camera_terms - 1) = 1.0;
    bool solved = false;
    cv::Matx<double, camera_terms, camera_terms> covariance = normal.inv(cv::DECOMP_CHOLESKY, &solved);
    if (!solved)
        throw Error("the pictures cannot support a calibration. Add:\n  - pictures with the board tilted by 30 to 45 "
                    "degrees in all directions, near and far");
    change = covariance * right;
    return covariance;
}

static void move(const std::vector<Block> &blocks, const CameraTerms &change, Camera &camera)
{
    static constexpr int at[4][2] = {{0, 0}, {1, 1}, {0, 2}, {1, 2}};
    for (int i = 0; i < 4; i++)
        camera.matrix.at<double>(at[i][0], at[i][1]) += change(i);
    for (int i = 0; i < lens_terms; i++)
        camera.distortion.at<double>(i) += change(4 + i);
    for (const Block &block : blocks) {
        PoseTerms moved = block.pose.inv() * (block.pose_right - block.mixed.t() * change);
        block.view->rvec += cv::Vec3d(moved(0), moved(1), moved(2));
        block.view->shift += cv::Vec3d(moved(3), moved(4), moved(5));
    }
}

static void report(const std::vector<Block> &blocks, const cv::Matx<double, camera_terms, camera_terms> &covariance,
                   Camera &camera)
{
    double sum = 0.0, count = 0.0;
    for (const Block &block : blocks) {
        double corners = static_cast<double>(block.view->corners.ids.size());
        block.view->rms_px = std::sqrt(block.square_sum / corners);
        sum += block.square_sum;
        count += corners;
    }
    camera.rms_px = std::sqrt(sum / count);
    for (int i = 0; i < 4; i++)
        camera.sigma_px[static_cast<size_t>(i)] = std::sqrt(covariance(i, i));
    for (int i = 0; i < lens_terms; i++)
        camera.lens_sigma[static_cast<size_t>(i)] = std::sqrt(covariance(4 + i, 4 + i));
}

void bundle_solve(const Board &board, std::vector<View> &views, Camera &camera)
{
    cv::Matx<double, camera_terms, camera_terms> covariance;
    for (int step = 0; step < steps; step++) {
        std::vector<Block> blocks = list_blocks(board, camera, views);
        CameraTerms change;
        covariance = solve(blocks, camera, change);
        move(blocks, change, camera);
        double max = 0.0;
        for (int i = 0; i < camera_terms; i++)
            max = std::max(max, std::abs(change(i)) / std::sqrt(covariance(i, i)));
        if (max < small_step)
            break;
    }
    report(list_blocks(board, camera, views), covariance, camera);
}
} // namespace cal
