/* cal_pictures - a frames directory as docs/contract.md describes it: binary PGM files, and frames.jsonl, which says in
 * which of them the laser was on. Without frames.jsonl the names say it: NAME-on.pgm and NAME-off.pgm.
 * Other files may lie beside them. A *.pgm that cannot be read, is cut short or has another size than the others is an
 * error; so is a file that is named in frames.jsonl twice, or named there and not there.
 */
#ifndef CAL_PICTURES_HPP
#define CAL_PICTURES_HPP

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace cal
{
/* A sensor's black level, roughly. */
constexpr double black_grey = 4.0;

struct Picture {
    std::string file;
    cv::Mat grey; /* CV_32F, 0 .. 255 whatever the file's bits are */
    bool laser;

    cv::Mat grey8() const;
};

/* Frames that host_sim and the board can use. */
constexpr int width_min = 320, height_min = 240, width_max = 1280, height_max = 800;
extern const char *const picture_sizes; /* the same in words */
bool picture_size_fits(cv::Size size);

/* Throws cal::Error, which begins with `where`, unless the size fits. */
void picture_check_size(const std::string &where, int width, int height);

/* The names of *.pgm, sorted; those of hidden files are left out. Throws cal::Error. */
std::vector<std::string> pictures_list(const std::string &dir);

/* The same, at least one. Throws cal::Error. */
std::vector<std::string> pictures_required(const std::string &dir);

/* One file. Throws cal::Error. */
cv::Mat picture_read(const std::string &path);
void picture_write(const std::string &path, const cv::Mat &grey8);

/* All of them in the order of their names, at least one. Throws cal::Error; one that stands for all unreadable files. */
std::vector<Picture> pictures_read(const std::string &dir);
} // namespace cal

#endif
