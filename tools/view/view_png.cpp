#include "view_png.hpp"

#include <algorithm>
#include <array>
#include <png.h>

#include "view_error.hpp"

namespace view
{
static constexpr int grey_count = 40, side = 6, colour_count = 256;
/* Channels that differ by less are grey. */
static constexpr int grey_spread = 10;

static int bin_of(const cv::Vec3b &pixel)
{
    auto [min, max] = std::minmax({pixel[0], pixel[1], pixel[2]});
    if (max - min < grey_spread)
        return ((pixel[0] + pixel[1] + pixel[2]) * (grey_count - 1) + 382) / 765;
    auto step = [](int value) { return (value * (side - 1) + 127) / 255; };
    return grey_count + (step(pixel[2]) * side + step(pixel[1])) * side + step(pixel[0]);
}

struct Paletted {
    cv::Mat1b index;
    std::array<png_color, colour_count> colours;
};

static Paletted to_palette(const cv::Mat3b &picture)
{
    struct Sum {
        int64_t count, blue, green, red;
    };
    std::array<Sum, colour_count> sums{};
    Paletted result{cv::Mat1b(picture.size()), {}};
    for (int y = 0; y < picture.rows; y++) {
        for (int x = 0; x < picture.cols; x++) {
            const cv::Vec3b &pixel = picture(y, x);
            int bin = bin_of(pixel);
            Sum &sum = sums[static_cast<size_t>(bin)];
            sum = {sum.count + 1, sum.blue + pixel[0], sum.green + pixel[1], sum.red + pixel[2]};
            result.index(y, x) = static_cast<uint8_t>(bin);
        }
    }
    for (size_t i = 0; i < colour_count; i++) {
        auto mean = [&](int64_t total) {
            return static_cast<png_byte>(sums[i].count > 0 ? (total + sums[i].count / 2) / sums[i].count : 0);
        };
        result.colours[i] = {mean(sums[i].red), mean(sums[i].green), mean(sums[i].blue)};
    }
    return result;
}

static void take(png_structp png, png_bytep data, size_t count)
{
    static_cast<std::string *>(png_get_io_ptr(png))->append(reinterpret_cast<const char *>(data), count);
}

static void flush(png_structp)
{
}

[[noreturn]] static void fail(png_structp png, png_const_charp reason)
{
    throw Error(*static_cast<const std::string *>(png_get_error_ptr(png)) + ": " + reason);
}

static void warn(png_structp, png_const_charp)
{
}

std::string png_encode(const cv::Mat3b &picture, const std::string &path)
{
    Paletted paletted = to_palette(picture);
    std::string bytes, name = path;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &name, fail, warn);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    if (info == nullptr)
        throw Error(path + ": libpng could not be started");
    png_set_write_fn(png, &bytes, take, flush);
    png_set_IHDR(png, info, static_cast<png_uint_32>(picture.cols), static_cast<png_uint_32>(picture.rows), 8,
                 PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_PLTE(png, info, paletted.colours.data(), colour_count);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    png_set_compression_level(png, 9);
    png_write_info(png, info);
    for (int y = 0; y < picture.rows; y++)
        png_write_row(png, paletted.index.ptr(y));
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return bytes;
}
} // namespace view
