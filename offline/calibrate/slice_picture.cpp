#include "slice_picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>

#include "offline/io/files/error.h"
#include "offline/render/cairo_png.h"

namespace alces::offline {
namespace {

constexpr int margin_px = 30;
constexpr int title_px = 50;
constexpr double layer_above_m = 1;  // the layer that shows a lean

struct Colour {
  double r, g, b;
};
constexpr std::array<Colour, 4> colours{
    {{0.85, 0.1, 0.1}, {0.95, 0.6, 0.1}, {0.1, 0.25, 0.85}, {0.1, 0.65, 0.6}}};

class Picture {
 public:
  Picture(int width_px, int height_px)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px), cairo_surface_destroy),
        cairo_(cairo_create(surface_.get()), cairo_destroy) {
    cairo_set_source_rgb(get(), 1, 1, 1);
    cairo_paint(get());
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(get(), 16);
  }
  [[nodiscard]] cairo_t* get() { return cairo_.get(); }
  void text(double x, double y, const std::string& words) {
    cairo_set_source_rgb(get(), 0.2, 0.2, 0.2);
    cairo_move_to(get(), x, y);
    cairo_show_text(get(), words.c_str());
  }
  void dot(double x, double y, const Colour& colour) {
    cairo_set_source_rgba(get(), colour.r, colour.g, colour.b, 0.7);
    cairo_rectangle(get(), x - 1, y - 1, 2, 2);
    cairo_fill(get());
  }
  void write_png(const std::filesystem::path& path) { offline::write_png(surface_.get(), path); }

 private:
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

}  // namespace

void draw_slices(const std::filesystem::path& png, std::span<const StandingRay> rays,
                 std::span<const Eigen::Vector3d> ends_m, std::span<const int> views,
                 const std::string& title, const SlicePictureSettings& settings) {
  const double side_px = settings.size_px;
  Picture picture(2 * settings.size_px + 3 * margin_px, settings.size_px + title_px + margin_px);
  const double scale_px = side_px / (2 * settings.reach_m);
  const std::array<double, 2> left_px{margin_px, 2 * margin_px + side_px};
  const double half_m = settings.thickness_m / 2;
  for (const double left : left_px) {
    cairo_set_source_rgb(picture.get(), 0.8, 0.8, 0.8);
    cairo_set_line_width(picture.get(), 1);
    cairo_rectangle(picture.get(), left + 0.5, title_px + 0.5, side_px, side_px);
    cairo_stroke(picture.get());
  }
  picture.text(margin_px, 30,
               fmt::format("{}: from above, {:.1f} m at the head and {:.1f} m above it; {:.0f} m wide", title,
                           settings.thickness_m, layer_above_m, 2 * settings.reach_m));
  picture.text(left_px[1], 30, "from the side: along the head's x");
  const auto draw = [&](double left, double across_m, double up_m, int view) {
    if (std::abs(across_m) >= settings.reach_m || std::abs(up_m) >= settings.reach_m) return;
    picture.dot(left + side_px / 2 + scale_px * across_m, title_px + side_px / 2 - scale_px * up_m,
                colours[static_cast<std::size_t>(view) % colours.size()]);
  };
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays[i].stand != 0) continue;
    const Eigen::Vector3d& p = ends_m[i];
    // Seen from above with x up the picture, as the vehicle looks ahead.
    if (std::abs(p.z()) <= half_m || std::abs(p.z() - layer_above_m) <= half_m)
      draw(left_px[0], -p.y(), p.x(), views[i]);
    if (std::abs(p.y()) <= half_m) draw(left_px[1], p.x(), p.z(), views[i]);
  }
  picture.write_png(png);
}

}  // namespace alces::offline
