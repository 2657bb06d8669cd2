/* view_canvas - what the pictures are drawn with: lines with a light or dark casing, so that they stand out on any
 * ground and in grey; text; grey images. Page units: a pixel of a PNG or a film.
 */
#ifndef VIEW_CANVAS_HPP
#define VIEW_CANVAS_HPP

#include <cairo.h>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace view
{
struct Colour {
    double red, green, blue;
};

/* Colours that the colour-blind can distinguish (Okabe and Ito); every line differs in its form as well. */
constexpr Colour black{0, 0, 0}, white{1, 1, 1}, blue{0, 0.447, 0.698}, vermilion{0.835, 0.369, 0},
    yellow{0.941, 0.894, 0.259}, sky{0.337, 0.706, 0.914};

struct Stroke {
    Colour colour;
    double width;
    std::vector<double> dashes; /* lengths on, off, on ..; empty: solid */
    bool hollow = false;        /* a double line */
    double casing = 0;          /* this much on either side .. */
    Colour casing_colour = white;
};

/* Where the frame is on the page. */
struct Plot {
    cv::Rect2d where;
    double scale;

    /* Pixel centres lie at integer coordinates. */
    cv::Point2d page(cv::Point2d pixel) const
    {
        return where.tl() + (pixel + cv::Point2d(0.5, 0.5)) * scale;
    }
};

/* As large as fits into the width and height, from its top left on. */
Plot plot_fit(cv::Size frame_px, cv::Rect2d room);

enum class Anchor { left, middle, right };

class Canvas
{
  public:
    explicit Canvas(cairo_t *cairo) : cairo_(cairo)
    {
    }
    void fill(cv::Rect2d where, Colour colour);
    void disc(cv::Point2d centre, double radius, Colour colour);
    void line(const std::vector<cv::Point2d> &positions, const Stroke &stroke, bool closed = false);
    void ellipse(cv::Point2d centre, double a, double b, double angle_deg, const Stroke &stroke);
    void cross(cv::Point2d centre, double radius, const Stroke &stroke, bool upright);
    /* The text's middle stands at the height of `at`. With a halo it is readable on anything. */
    void text(cv::Point2d at, const std::string &words, double size, Anchor anchor = Anchor::left, bool bold = false,
              Colour colour = black);
    void text_with_halo(cv::Point2d at, const std::string &words, double size, Anchor anchor, Colour colour,
                        Colour halo);
    double text_width(const std::string &words, double size, bool bold = false);
    /* 8-bit grey, stretched over the rectangle. */
    void image(const cv::Mat1b &grey, cv::Rect2d where);
    void clip(cv::Rect2d where);
    void unclip();

  private:
    void set(Colour colour);
    void trace(const Stroke &stroke);
    cairo_t *cairo_;
};

/* What is taken on a page, so that no text covers another. */
class Room
{
  public:
    explicit Room(cv::Rect2d page) : page_(page)
    {
    }
    /* False: it would leave the page or cover something. */
    bool take(cv::Rect2d wanted);
    /* Whether it fits or not. */
    void block(cv::Rect2d taken)
    {
        taken_.push_back(taken);
    }

  private:
    cv::Rect2d page_;
    std::vector<cv::Rect2d> taken_;
};
} // namespace view

#endif
