#include "cal_pictures.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "cal_error.hpp"
#include "tool_file.hpp"

namespace cal
{
const char *const picture_sizes = "320x240 to 1280x800 pixels";

cv::Mat Picture::grey8() const
{
    cv::Mat bytes;
    grey.convertTo(bytes, CV_8U);
    return bytes;
}

/* The next number of a PGM's header; comments are skipped. */
static int header_number(std::istream &file, const std::string &path)
{
    int value = -1;
    file >> std::ws;
    while (file.peek() == '#') {
        std::string comment;
        std::getline(file, comment);
        file >> std::ws;
    }
    if (!(file >> value))
        throw Error(path + ": the header of a binary PGM must have three numbers: width, height, maxval");
    return value;
}

bool picture_size_fits(cv::Size size)
{
    return size.width >= width_min && size.height >= height_min && size.width <= width_max && size.height <= height_max;
}

void picture_check_size(const std::string &where, int width, int height)
{
    if (!picture_size_fits({width, height}))
        throw Error(where + text(": %dx%d pixels; must be from ", width, height) + picture_sizes);
}

/* A pipe would be waited for. */
static std::ifstream open_file(const std::string &path)
{
    std::error_code unknown; /* of a file that is not there or not to be seen: opening it says why */
    auto kind = std::filesystem::status(path, unknown).type();
    if (!unknown && kind != std::filesystem::file_type::regular && kind != std::filesystem::file_type::not_found)
        throw Error(path + ": is a directory, device or pipe, expected a file");
    return std::ifstream(path, std::ios::binary);
}

cv::Mat picture_read(const std::string &path)
{
    std::ifstream file = open_file(path);
    char magic[2] = {0, 0};
    if (!file)
        throw Error(path + ": " + std::strerror(errno));
    if (!file.read(magic, 2) || magic[0] != 'P' || magic[1] != '5')
        throw Error(path + ": no binary PGM (P5)");
    int width = header_number(file, path), height = header_number(file, path), max = header_number(file, path);
    picture_check_size(path, width, height);
    if (max < 1 || max > 65535)
        throw Error(path + text(": maxval %d; must be from 1 to 65535", max));
    file.get();
    size_t sample_bytes = max > 255 ? 2 : 1, count = static_cast<size_t>(width) * static_cast<size_t>(height);
    std::vector<unsigned char> data(count * sample_bytes);
    file.read(reinterpret_cast<char *>(data.data()), static_cast<std::streamsize>(data.size()));
    if (static_cast<size_t>(file.gcount()) != data.size())
        throw Error(path +
                    text(": cut short: %zu of %zu bytes of samples", static_cast<size_t>(file.gcount()), data.size()));
    cv::Mat grey(height, width, CV_32F);
    for (size_t i = 0; i < count; i++) {
        int sample = sample_bytes == 2 ? data[2 * i] * 256 + data[2 * i + 1] : data[i];
        if (sample > max)
            throw Error(path + text(": sample %zu is %d, more than the maxval %d", i, sample, max));
        grey.ptr<float>()[i] = static_cast<float>(sample) * 255.0f / static_cast<float>(max);
    }
    return grey;
}

void picture_write(const std::string &path, const cv::Mat &grey8)
{
    cv::Mat whole = grey8.isContinuous() ? grey8 : grey8.clone();
    tool::file_write(path,
                     text("P5\n%d %d\n255\n", whole.cols, whole.rows).append(whole.begin<uchar>(), whole.end<uchar>()));
}

static bool ends_with(const std::string &name, const std::string &end)
{
    return name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

/* A line's object. The parser takes the last of two fields of one name, host_sim takes none. */
static nlohmann::json parse_line(const std::string &line, const std::string &where)
{
    using Event = nlohmann::json::parse_event_t;
    std::set<std::string> names;
    return nlohmann::json::parse(line, [&](int depth, Event event, const nlohmann::json &value) {
        if (event == Event::key && depth == 1 && !names.insert(value.get<std::string>()).second)
            throw Error(where + ": " + value.get<std::string>() + ": a second time");
        return true;
    });
}

/* Which files had the laser on, by frames.jsonl. */
static std::map<std::string, bool> read_list(const std::string &path)
{
    std::map<std::string, bool> lasers;
    std::ifstream list = open_file(path);
    std::string line;
    if (!list && errno != ENOENT)
        throw Error(path + ": " + std::strerror(errno));
    for (int number = 1; std::getline(list, line); number++) {
        if (line.find_first_not_of(" \t\r") == std::string::npos)
            continue;
        try {
            nlohmann::json entry = parse_line(line, path + text(":%d", number));
            bool laser = entry.at("laser").get<bool>();
            if (!lasers.emplace(entry.at("file").get<std::string>(), laser).second)
                throw Error(path + text(":%d: names a file that an earlier line names", number));
        } catch (const nlohmann::json::parse_error &) {
            throw Error(path + text(":%d: is no JSON; must be like {\"file\":\"000000.pgm\",\"laser\":true}", number));
        } catch (const nlohmann::json::exception &) {
            throw Error(path +
                        text(":%d: must have a \"file\" in quotes and a \"laser\" that is true or false", number));
        }
    }
    if (list.bad())
        throw Error(path + ": could not be read: " + std::strerror(errno));
    return lasers;
}

static bool laser_of(const std::string &dir, const std::string &name, const std::map<std::string, bool> &list)
{
    auto entry = list.find(name);
    if (entry != list.end())
        return entry->second;
    if (!list.empty())
        throw Error(dir + "/" + name + ": is not listed in frames.jsonl");
    if (!ends_with(name, "-on.pgm") && !ends_with(name, "-off.pgm"))
        throw Error(dir + "/" + name + ": was the laser on? Say it in frames.jsonl, or name the file NAME-on.pgm or " +
                    "NAME-off.pgm");
    return ends_with(name, "-on.pgm");
}

/* Neither a list nor any name says it: that is one error, not one of each file. */
static void check_listed(const std::string &dir, const std::vector<std::string> &names,
                         const std::map<std::string, bool> &list)
{
    bool reported = !list.empty() || std::any_of(names.begin(), names.end(), [](const std::string &name) {
        return ends_with(name, "-on.pgm") || ends_with(name, "-off.pgm");
    });
    if (!reported)
        throw Error(dir + ": in which pictures was the laser on? Say it in " + dir +
                    "/frames.jsonl, or name the files NAME-on.pgm and NAME-off.pgm");
}

std::vector<std::string> pictures_list(const std::string &dir)
{
    std::vector<std::string> names;
    std::error_code failed;
    std::filesystem::directory_iterator entry(dir, failed), end;
    for (; !failed && entry != end; entry.increment(failed)) {
        std::string name = entry->path().filename();
        if (name.front() != '.' && entry->path().extension() == ".pgm")
            names.push_back(name);
    }
    if (failed)
        throw Error(dir + ": " + failed.message());
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> pictures_required(const std::string &dir)
{
    std::vector<std::string> names = pictures_list(dir);
    if (names.empty())
        throw Error(dir + ": no *.pgm in it; pictures of other kinds must be made binary PGM first");
    return names;
}

std::vector<Picture> pictures_read(const std::string &dir)
{
    std::vector<Picture> pictures;
    std::vector<std::string> names = pictures_required(dir);
    std::map<std::string, bool> list = read_list(dir + "/frames.jsonl");
    check_listed(dir, names, list);
    std::string faults;
    for (const auto &entry : list) {
        if (!std::binary_search(names.begin(), names.end(), entry.first))
            faults += dir + "/frames.jsonl: names " + entry.first + ", which is not there\n";
    }
    for (const std::string &name : names) {
        try {
            pictures.push_back({name, picture_read(dir + "/" + name), laser_of(dir, name, list)});
            if (pictures.back().grey.size() != pictures.front().grey.size())
                throw Error(dir + "/" + name + ": has another size than " + pictures.front().file);
        } catch (const Error &error) {
            faults += std::string(error.what()) + "\n";
        }
    }
    if (!faults.empty())
        throw Error(faults.substr(0, faults.size() - 1));
    return pictures;
}
} // namespace cal
