#include "view_output.hpp"

#include <algorithm>
#include <array>
#include <cairo-pdf.h>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <png.h>
#include <string>
#include <unistd.h>

#include "tool_file.hpp"
#include "view_error.hpp"

namespace view
{
/* A picture as a PNG with a palette: a third of the size that OpenCV's encoder needs for line art.
 * 40 greys, and 216 bins of colours, each as the mean of the pixels in it: lines keep their colour, and what is rare is
 * off by at most 51 of 255 in a channel. */
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

/* The file's bytes; path is for messages. */
static std::string png_encode(const cv::Mat3b &picture, const std::string &path)
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

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

static void check(cairo_status_t status, const std::string &path)
{
    if (status != CAIRO_STATUS_SUCCESS)
        throw Error(path + ": could not be drawn: " + cairo_status_to_string(status));
}

static cv::Mat3b draw_pixels(cv::Size size, const Drawing &draw, const std::string &path)
{
    Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, size.width, size.height), cairo_surface_destroy);
    Context context(cairo_create(surface.get()), cairo_destroy);
    Canvas canvas(context.get());
    canvas.fill({0, 0, static_cast<double>(size.width), static_cast<double>(size.height)}, white);
    draw(canvas);
    check(cairo_status(context.get()), path);
    cairo_surface_flush(surface.get());
    cv::Mat4b pixels(size.height, size.width,
                     reinterpret_cast<cv::Vec4b *>(cairo_image_surface_get_data(surface.get())),
                     static_cast<size_t>(cairo_image_surface_get_stride(surface.get())));
    cv::Mat3b picture;
    cv::cvtColor(pixels, picture, cv::COLOR_BGRA2BGR);
    return picture;
}

class Png : public Output
{
  public:
    explicit Png(std::string path) : path_(std::move(path))
    {
    }
    void page(cv::Size size, const Drawing &draw) override
    {
        std::string bytes = png_encode(draw_pixels(size, draw, path_), path_);
        tool::file_write(path_, bytes);
    }
    void finish() override
    {
    }

  private:
    std::string path_;
};

class Pdf : public Output
{
  public:
    explicit Pdf(std::string path) : path_(std::move(path)), surface_(nullptr, cairo_surface_destroy)
    {
        surface_.reset(cairo_pdf_surface_create_for_stream(take, &bytes_, long_side_pt, short_side_pt));
    }
    /* Upright or on its side, as the page is; as large as the margins leave. */
    void page(cv::Size size, const Drawing &draw) override
    {
        bool wide = size.width > size.height;
        double width = wide ? long_side_pt : short_side_pt, height = wide ? short_side_pt : long_side_pt;
        Plot plot = plot_fit(size, {0, 0, width - 2 * margin_pt, height - 2 * margin_pt});
        cairo_pdf_surface_set_size(surface_.get(), width, height);
        Context context(cairo_create(surface_.get()), cairo_destroy);
        cairo_translate(context.get(), (width - plot.where.width) / 2, (height - plot.where.height) / 2);
        cairo_scale(context.get(), plot.scale, plot.scale);
        Canvas canvas(context.get());
        draw(canvas);
        cairo_show_page(context.get());
        check(cairo_status(context.get()), path_);
    }
    void finish() override
    {
        cairo_surface_finish(surface_.get());
        check(cairo_surface_status(surface_.get()), path_);
        tool::file_write(path_, bytes_);
    }

  private:
    static constexpr double long_side_pt = 841.89, short_side_pt = 595.28, margin_pt = 28;
    static cairo_status_t take(void *bytes, const unsigned char *data, unsigned int count)
    {
        static_cast<std::string *>(bytes)->append(reinterpret_cast<const char *>(data), count);
        return CAIRO_STATUS_SUCCESS;
    }
    std::string path_, bytes_;
    Surface surface_;
};

class Film : public Output
{
  public:
    Film(std::string path, double frames_per_s)
        : path_(std::move(path)), part_path_(path_ + ".part.mp4"), frames_per_s_(frames_per_s)
    {
    }
    ~Film() override
    {
        if (!finished_) {
            writer_.release();
            std::remove(part_path_.c_str());
        }
    }
    Film(const Film &) = delete;
    Film &operator=(const Film &) = delete;
    void page(cv::Size size, const Drawing &draw) override
    {
        if (!writer_.isOpened())
            open(size);
        writer_.write(draw_pixels(size, draw, path_));
        page_count_++;
    }
    void finish() override;

  private:
    void open(cv::Size size);
    std::string path_, part_path_; /* its name until it is whole; the end says what it is */
    double frames_per_s_;
    int page_count_ = 0;
    cv::VideoWriter writer_;
    bool finished_ = false;
};

void Film::open(cv::Size size)
{
    std::ofstream file(part_path_, std::ios::binary);
    if (!file)
        throw Error(path_ + ": could not be written: " + std::strerror(errno));
    file.close();
    if (writer_.open(part_path_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('a', 'v', 'c', '1'), frames_per_s_, size))
        return;
    if (!writer_.open(part_path_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), frames_per_s_, size))
        throw Error(path_ + ": this OpenCV has no encoder for MP4, neither H.264 nor MPEG-4 part 2: it needs FFmpeg's "
                            "(Debian: libopencv-videoio with libavcodec); PNG and PDF need none");
    std::fprintf(stderr, "view: %s: no H.264 encoder: written as MPEG-4 part 2, which browsers do not play\n",
                 path_.c_str());
}

/* The writer does not report a full disk: its file is checked. */
void Film::finish()
{
    writer_.release();
    cv::VideoCapture written(part_path_, cv::CAP_FFMPEG);
    if (!written.isOpened() || cvRound(written.get(cv::CAP_PROP_FRAME_COUNT)) != page_count_)
        throw Error(path_ + ": could not be written whole; is there room for it?");
    if (std::rename(part_path_.c_str(), path_.c_str()) != 0)
        throw Error(path_ + ": could not be written: " + std::strerror(errno));
    finished_ = true;
}

Format format_of(const std::string &path)
{
    static const std::pair<const char *, Format> ends[] = {
        {".png", Format::png}, {".pdf", Format::pdf}, {".mp4", Format::mp4}};
    for (const auto &[end, format] : ends) {
        if (path.size() > 4 && path.compare(path.size() - 4, 4, end) == 0)
            return format;
    }
    throw Error(path + ": must end in .png, .pdf or .mp4");
}

std::unique_ptr<Output> output_open(const std::string &path, double frames_per_s)
{
    switch (format_of(path)) {
    case Format::png:
        return std::make_unique<Png>(path);
    case Format::pdf:
        return std::make_unique<Pdf>(path);
    case Format::mp4:
        break;
    }
    return std::make_unique<Film>(path, frames_per_s);
}
} // namespace view
