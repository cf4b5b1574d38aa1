// The picture's layout and everything drawn over the points; the points themselves are in render_points.cpp.
#include "render.h"

#include <cairo.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "cairo_png.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/ply_stream.h"
#include "render_points.h"

namespace alces::offline {
namespace {

struct Loop {
  std::size_t first = 0;
  std::size_t last = 0;
  bool accepted = false;
};

struct Map {
  Trajectory trajectory;
  std::vector<Loop> loops;
  std::filesystem::path ply;  // empty: none
  std::vector<Point> sample;  // of the points
  std::vector<Point> driven;  // positions of the trajectories
  Box box;                    // what the view from above shows
  HeightRange height;
};

std::vector<Loop> read_loops(const std::filesystem::path& file, std::size_t scan_count) {
  std::vector<Loop> loops;
  if (!std::filesystem::exists(file)) return loops;
  std::string bytes;
  read_file(file, bytes);
  const nlohmann::json json = nlohmann::json::parse(bytes, nullptr, false);
  if (!json.is_object()) throw InputError(file, "is no JSON object; map the scans again");
  if (!json.contains("loops")) return loops;
  for (const nlohmann::json& entry : json["loops"]) {
    const auto scan = [&](const char* key) {
      if (!entry.is_object() || !entry.contains(key) || !entry[key].is_number_unsigned() ||
          entry[key].get<std::size_t>() >= scan_count) {
        throw InputError(
            file, fmt::format("loop {} names no scan below {} as \"{}\"", loops.size(), scan_count, key));
      }
      return entry[key].get<std::size_t>();
    };
    const std::size_t first = scan("first");
    loops.push_back({first, scan("last"), entry.value("accepted", false)});
  }
  return loops;
}

Point to_point(const Eigen::Vector3d& place) {
  const Eigen::Vector3f rounded = place.cast<float>();
  return {rounded.x(), rounded.y(), rounded.z()};
}

/// The frame: the trajectories, and of a sample of the points the middle 99 % along each axis.
void measure(Map& map, const RenderSettings& settings) {
  std::array<std::vector<float>, 3> axes;
  if (!map.ply.empty()) {
    constexpr std::size_t every = 29;
    std::size_t next = 0;
    (void)stream_ply(map.ply, [&](std::span<const Point> points) {
      for (; next < points.size(); next += every) {
        const Point& point = points[next];
        if (!is_finite(point)) continue;
        map.sample.push_back(point);
        axes[0].push_back(point.x);
        axes[1].push_back(point.y);
        axes[2].push_back(point.z);
      }
      next -= points.size();
    });
  }
  Eigen::Vector3d low = map.trajectory.poses.front().translation_m;
  Eigen::Vector3d high = low;
  const auto include = [&](const Eigen::Vector3d& place) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  };
  const auto include_all = [&](const Trajectory& trajectory) {
    for (const Pose& pose : trajectory.poses) {
      include(pose.translation_m);
      map.driven.push_back(to_point(pose.translation_m));
    }
  };
  include_all(map.trajectory);
  if (settings.compare) include_all(*settings.compare);
  map.height = {low.z() - 1, high.z() + 1};
  if (!axes[0].empty()) {
    map.height = {quantile(axes[2], 0.02), quantile(axes[2], 0.98)};
    include({quantile(axes[0], 0.005), quantile(axes[1], 0.005), quantile(axes[2], 0.005)});
    include({quantile(axes[0], 0.995), quantile(axes[1], 0.995), quantile(axes[2], 0.995)});
  }
  const double margin_m = std::max(1.0, 0.02 * (high - low).head<2>().maxCoeff());
  map.box.min = low - Eigen::Vector3d(margin_m, margin_m, 0);
  map.box.max = high + Eigen::Vector3d(margin_m, margin_m, 0.5);
  // No sliver: a drive along a line still gets a strip a quarter as wide as it is long.
  const Eigen::Vector2d size_m = (map.box.max - map.box.min).head<2>();
  for (const int axis : {0, 1}) {
    const double missing_m = 0.25 * size_m.maxCoeff() - size_m(axis);
    if (missing_m <= 0) continue;
    map.box.min(axis) -= missing_m / 2;
    map.box.max(axis) += missing_m / 2;
  }
}

Map open_map(const std::filesystem::path& folder, const RenderSettings& settings) {
  Map map;
  map.trajectory = read_trajectory(folder);
  if (map.trajectory.size() == 0) throw InputError(folder, "the trajectory holds no poses");
  map.loops = read_loops(folder / "run.json", map.trajectory.size());
  if (std::filesystem::exists(folder / "map.ply")) map.ply = folder / "map.ply";
  measure(map, settings);
  return map;
}

// ------------------------------------------------------------------------------------------------ drawing

struct Color {
  double r, g, b, a;
};
constexpr Color ink{0.91, 0.93, 0.96, 1};
constexpr Color faint_ink{0.62, 0.67, 0.75, 1};
constexpr Color grid{1, 1, 1, 0.07};
constexpr Color drive{1.0, 1.0, 1.0, 0.92};
constexpr Color compared{0.95, 0.45, 0.95, 0.95};
constexpr Color accepted{0.25, 1.0, 0.45, 1};
constexpr Color refused{1.0, 0.28, 0.28, 1};
constexpr Color start_color{0.35, 0.8, 1.0, 1};
constexpr Color end_color{1.0, 0.65, 0.15, 1};
constexpr Color x_color{1.0, 0.35, 0.35, 1};
constexpr Color y_color{0.4, 0.9, 0.4, 1};
constexpr Color z_color{0.45, 0.65, 1.0, 1};

class Canvas {
 public:
  Canvas(int width_px, int height_px)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px), cairo_surface_destroy),
        cairo_(cairo_create(surface_.get()), cairo_destroy) {
    if (cairo_status(cairo_.get()) != CAIRO_STATUS_SUCCESS) throw std::bad_alloc();
    cairo_set_line_join(cairo_.get(), CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cairo_.get(), CAIRO_LINE_CAP_ROUND);
  }

  [[nodiscard]] cairo_t* get() { return cairo_.get(); }

  void color(const Color& c) { cairo_set_source_rgba(get(), c.r, c.g, c.b, c.a); }

  void line(double x0, double y0, double x1, double y1, double width) {
    cairo_set_line_width(get(), width);
    cairo_move_to(get(), x0, y0);
    cairo_line_to(get(), x1, y1);
    cairo_stroke(get());
  }

  void disc(double x, double y, double radius) {
    cairo_new_sub_path(get());
    cairo_arc(get(), x, y, radius, 0, 2 * 3.14159265358979);
    cairo_fill(get());
  }

  void ring(double x, double y, double radius, double width) {
    cairo_set_line_width(get(), width);
    cairo_new_sub_path(get());
    cairo_arc(get(), x, y, radius, 0, 2 * 3.14159265358979);
    cairo_stroke(get());
  }

  /// `anchor`: 0 left, 0.5 centred, 1 right of x. Returns the width.
  double text(double x, double y, double size, const std::string& text, double anchor = 0,
              bool bold = false) {
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(get(), size);
    cairo_text_extents_t extents;
    cairo_text_extents(get(), text.c_str(), &extents);
    cairo_move_to(get(), x - anchor * extents.x_advance, y);
    cairo_show_text(get(), text.c_str());
    return extents.x_advance;
  }

  /// Text that stays readable over points: on a dark outline.
  void label(double x, double y, double size, const std::string& text, const Color& c, double anchor = 0) {
    cairo_set_font_size(get(), size);
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
    cairo_text_extents_t extents;
    cairo_text_extents(get(), text.c_str(), &extents);
    cairo_move_to(get(), x - anchor * extents.x_advance, y);
    cairo_text_path(get(), text.c_str());
    color({0.04, 0.06, 0.09, 0.85});
    cairo_set_line_width(get(), 0.3 * size);
    cairo_stroke_preserve(get());
    color(c);
    cairo_fill(get());
  }

  void paint(const std::vector<Rgb8>& image, int width_px, double x, double y) {
    const int height_px = static_cast<int>(image.size()) / width_px;
    const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> source(
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px), cairo_surface_destroy);
    unsigned char* bytes = cairo_image_surface_get_data(source.get());
    if (bytes == nullptr) throw std::bad_alloc();
    const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(source.get()));
    const auto width = static_cast<std::size_t>(width_px);
    for (std::size_t i = 0; i < image.size(); ++i) {
      const std::uint32_t pixel =
          (std::uint32_t{image[i].r} << 16) | (std::uint32_t{image[i].g} << 8) | image[i].b;
      std::memcpy(bytes + i / width * stride + 4 * (i % width), &pixel, sizeof pixel);
    }
    cairo_surface_mark_dirty(source.get());
    cairo_set_source_surface(get(), source.get(), x, y);
    cairo_rectangle(get(), x, y, width_px, height_px);
    cairo_fill(get());
  }

  void write_png(const std::filesystem::path& path) { offline::write_png(surface_.get(), path); }

 private:
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

/// 1, 2 or 5 times a power of ten, not above `value`.
double round_step(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= value) return factor * power;
  }
  return power;
}

std::string metres_text(double value_m) {
  return fmt::format("{:g} m", value_m);
}

std::string with_suffix(std::uint64_t count) {
  if (count >= 1'000'000) return fmt::format("{:.2f} M", static_cast<double>(count) / 1e6);
  if (count >= 10'000) return fmt::format("{:.1f} k", static_cast<double>(count) / 1e3);
  return fmt::format("{}", count);
}

double path_length_m(const Trajectory& trajectory) {
  double length_m = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length_m += (trajectory.poses[i].translation_m - trajectory.poses[i - 1].translation_m).norm();
  }
  return length_m;
}

/// One view: where it lies on the canvas, and what is drawn over its points. `u` is the unit of all sizes.
struct Panel {
  const Camera& camera;
  double left;
  double top;
  double u;

  [[nodiscard]] Projected at(const Eigen::Vector3d& point) const {
    Projected place = camera.project(point);
    place.x += left;
    place.y += top;
    return place;
  }
};

/// The number at a grid line: no rounding error of the steps, no minus before a zero.
std::string tick(double value_m, double step_m) {
  return fmt::format("{:g}", step_m * std::round(value_m / step_m) + 0.0);
}

void draw_grid(Canvas& canvas, const Panel& panel, const Box& box) {
  const double step_m = round_step((box.max - box.min).head<2>().maxCoeff() / 6);
  const double bottom = panel.top + panel.camera.height_px();
  for (double x_m = std::ceil(box.min.x() / step_m) * step_m; x_m < box.max.x(); x_m += step_m) {
    const double x = panel.at({x_m, 0, 0}).x;
    canvas.color(grid);
    canvas.line(x, panel.top, x, bottom, panel.u);
    canvas.color(faint_ink);
    canvas.text(x, bottom + 17 * panel.u, 12 * panel.u, tick(x_m, step_m), 0.5);
  }
  for (double y_m = std::ceil(box.min.y() / step_m) * step_m; y_m < box.max.y(); y_m += step_m) {
    const double y = panel.at({0, y_m, 0}).y;
    canvas.color(grid);
    canvas.line(panel.left, y, panel.left + panel.camera.width_px(), y, panel.u);
    canvas.color(faint_ink);
    canvas.text(panel.left - 6 * panel.u, y + 4 * panel.u, 12 * panel.u, tick(y_m, step_m), 1);
  }
}

void draw_trajectory(Canvas& canvas, const Panel& panel, const Trajectory& trajectory, const Color& color,
                     bool dashed) {
  const auto path = [&] {
    for (const Pose& pose : trajectory.poses) {
      const Projected place = panel.at(pose.translation_m);
      cairo_line_to(canvas.get(), place.x, place.y);
    }
  };
  const double dashes[2] = {7 * panel.u, 5 * panel.u};
  path();
  canvas.color({0, 0, 0, 0.55});
  cairo_set_line_width(canvas.get(), 4.5 * panel.u);
  cairo_stroke(canvas.get());
  path();
  canvas.color(color);
  cairo_set_line_width(canvas.get(), 1.8 * panel.u);
  if (dashed) cairo_set_dash(canvas.get(), dashes, 2, 0);
  cairo_stroke(canvas.get());
  cairo_set_dash(canvas.get(), nullptr, 0, 0);
}

/// A ring about the place where the loop closes, and a line between its two scans as far as they lie apart.
void draw_loops(Canvas& canvas, const Panel& panel, const Map& map) {
  for (const bool is_accepted : {false, true}) {
    for (const Loop& loop : map.loops) {
      if (loop.accepted != is_accepted) continue;
      const Projected first = panel.at(map.trajectory.poses[loop.first].translation_m);
      const Projected last = panel.at(map.trajectory.poses[loop.last].translation_m);
      const double radius = (is_accepted ? 8 : 6) * panel.u;
      const double x = (first.x + last.x) / 2;
      const double y = (first.y + last.y) / 2;
      for (const bool outline : {true, false}) {
        canvas.color(outline ? Color{0, 0, 0, 0.6} : is_accepted ? accepted : refused);
        const double width = (outline ? 5 : 2.2) * panel.u;
        canvas.line(first.x, first.y, last.x, last.y, width);
        canvas.ring(x, y, radius, width);
        if (is_accepted) continue;
        const double arm = 0.7 * radius;
        canvas.line(x - arm, y - arm, x + arm, y + arm, width);
        canvas.line(x - arm, y + arm, x + arm, y - arm, width);
      }
    }
  }
}

void draw_ends(Canvas& canvas, const Panel& panel, const Trajectory& trajectory) {
  const auto mark = [&](const Pose& pose, const Color& color, const char* name, double drop) {
    const Projected place = panel.at(pose.translation_m);
    canvas.color({0, 0, 0, 0.7});
    canvas.disc(place.x, place.y, 7 * panel.u);
    canvas.color(color);
    canvas.disc(place.x, place.y, 5 * panel.u);
    const bool at_edge = place.x + 60 * panel.u > panel.left + panel.camera.width_px();
    const double beside = (at_edge ? -11 : 11) * panel.u;
    canvas.label(place.x + beside, place.y + drop * panel.u, 14 * panel.u, name, color, at_edge ? 1 : 0);
  };
  mark(trajectory.poses.front(), start_color, "start", -6);
  mark(trajectory.poses.back(), end_color, "end", 16);
}

void draw_axes(Canvas& canvas, const Panel& panel) {
  const double x = panel.left + 40 * panel.u;
  const double y = panel.top + panel.camera.height_px() - 40 * panel.u;
  const Projected origin = panel.at(Eigen::Vector3d::Zero());
  struct Axis {
    Eigen::Vector3d direction;
    Color color;
    const char* name;
  };
  const std::array<Axis, 3> axes{{{Eigen::Vector3d::UnitX(), x_color, "x"},
                                  {Eigen::Vector3d::UnitY(), y_color, "y"},
                                  {Eigen::Vector3d::UnitZ(), z_color, "z"}}};
  for (const Axis& axis : axes) {
    const Projected tip = panel.at(axis.direction);
    const double dx = (tip.x - origin.x) / panel.camera.pixels_per_metre();
    const double dy = (tip.y - origin.y) / panel.camera.pixels_per_metre();
    if (std::hypot(dx, dy) < 0.1) continue;  // seen end on
    const double length = 42 * panel.u;
    for (const bool outline : {true, false}) {
      canvas.color(outline ? Color{0, 0, 0, 0.6} : axis.color);
      canvas.line(x, y, x + length * dx, y + length * dy, (outline ? 5 : 2.5) * panel.u);
    }
    canvas.label(x + length * 1.3 * dx, y + length * 1.3 * dy + 5 * panel.u, 14 * panel.u, axis.name,
                 axis.color, 0.5);
  }
}

void draw_scale_bar(Canvas& canvas, const Panel& panel) {
  const double length_m = round_step(0.2 * panel.camera.width_px() / panel.camera.pixels_per_metre());
  const double length = length_m * panel.camera.pixels_per_metre();
  const double right = panel.left + panel.camera.width_px() - 20 * panel.u;
  const double y = panel.top + panel.camera.height_px() - 20 * panel.u;
  for (const bool outline : {true, false}) {
    canvas.color(outline ? Color{0, 0, 0, 0.7} : ink);
    const double width = (outline ? 6 : 2.5) * panel.u;
    canvas.line(right - length, y, right, y, width);
    for (const double x : {right - length, right}) canvas.line(x, y - 5 * panel.u, x, y + 5 * panel.u, width);
  }
  canvas.label(right - length / 2, y - 9 * panel.u, 14 * panel.u, metres_text(length_m), ink, 0.5);
}

/// Everything over the points, and the frame.
void draw_over(Canvas& canvas, const Panel& panel, const Map& map, const RenderSettings& settings,
               bool is_top) {
  const double width = panel.camera.width_px();
  const double height = panel.camera.height_px();
  if (is_top) draw_grid(canvas, panel, map.box);
  cairo_save(canvas.get());
  cairo_rectangle(canvas.get(), panel.left, panel.top, width, height);
  cairo_clip(canvas.get());
  if (settings.compare) draw_trajectory(canvas, panel, *settings.compare, compared, true);
  draw_trajectory(canvas, panel, map.trajectory, drive, false);
  draw_loops(canvas, panel, map);
  draw_ends(canvas, panel, map.trajectory);
  draw_axes(canvas, panel);
  if (is_top) draw_scale_bar(canvas, panel);
  cairo_restore(canvas.get());
  canvas.color({1, 1, 1, 0.25});
  cairo_set_line_width(canvas.get(), panel.u);
  cairo_rectangle(canvas.get(), panel.left - 0.5, panel.top - 0.5, width + 1, height + 1);
  cairo_stroke(canvas.get());
}

/// Samples with names in one row; wraps at `right`. Drawing and measuring are one: returns the rows used.
int draw_legend(Canvas& canvas, const Map& map, const RenderSettings& settings, const RenderReport& report,
                double left, double right, double top, double u) {
  double x = left;
  double y = top;
  int rows = 1;
  const auto room = [&](double width) {
    if (x > left && x + width > right) {
      x = left;
      y += 26 * u;
      ++rows;
    }
  };
  const auto entry = [&](const std::string& name, auto sample) {
    room((44 + 8.5 * static_cast<double>(name.size())) * u);
    sample(x, y - 5 * u);
    canvas.color(ink);
    x += 34 * u + canvas.text(x + 34 * u, y, 14 * u, name) + 26 * u;
  };
  const auto stroke = [&](const Color& c, bool dashed) {
    return [&canvas, c, dashed, u](double at_x, double at_y) {
      const double dashes[2] = {7 * u, 5 * u};
      canvas.color(c);
      if (dashed) cairo_set_dash(canvas.get(), dashes, 2, 0);
      canvas.line(at_x, at_y, at_x + 26 * u, at_y, 2.2 * u);
      cairo_set_dash(canvas.get(), nullptr, 0, 0);
    };
  };
  if (!map.ply.empty()) {
    const std::string low = fmt::format("z {:.1f}", std::round(10 * map.height.low_m) / 10 + 0.0);
    const std::string high = fmt::format("{:.1f} m", map.height.high_m);
    room(330 * u);
    canvas.color(ink);
    x += canvas.text(x, y, 14 * u, low) + 8 * u;
    for (int i = 0; i < 160; ++i) {
      const Rgb8 c = height_color(i / 159.0);
      canvas.color({c.r / 255.0, c.g / 255.0, c.b / 255.0, 1});
      cairo_rectangle(canvas.get(), x + i * u, y - 12 * u, u + 0.5, 13 * u);
      cairo_fill(canvas.get());
    }
    canvas.color(ink);
    x += 168 * u;
    x += canvas.text(x, y, 14 * u, high) + 26 * u;
  }
  entry("trajectory", stroke(drive, false));
  if (settings.compare) entry(settings.compare_name, stroke(compared, true));
  if (report.loops_accepted > 0) {
    entry(fmt::format("loop closed ({})", report.loops_accepted), [&](double at_x, double at_y) {
      canvas.color(accepted);
      canvas.ring(at_x + 15 * u, at_y, 7 * u, 2.2 * u);
    });
  }
  if (report.loops_refused > 0) {
    entry(fmt::format("loop refused ({})", report.loops_refused), [&](double at_x, double at_y) {
      canvas.color(refused);
      canvas.ring(at_x + 15 * u, at_y, 6 * u, 2.2 * u);
      canvas.line(at_x + 11 * u, at_y - 4 * u, at_x + 19 * u, at_y + 4 * u, 2.2 * u);
      canvas.line(at_x + 11 * u, at_y + 4 * u, at_x + 19 * u, at_y - 4 * u, 2.2 * u);
    });
  }
  return rows;
}

std::string subtitle(const Map& map, const RenderReport& report) {
  std::string text =
      fmt::format("{} scans  ·  {:.1f} m driven  ·  ", map.trajectory.size(), path_length_m(map.trajectory));
  text += map.ply.empty() ? "no map.ply, so no points" : with_suffix(report.points) + " points";
  if (!map.loops.empty()) {
    text += fmt::format("  ·  {} loops closed, {} refused", report.loops_accepted, report.loops_refused);
  }
  if (map.trajectory.has_time) {
    const auto [first, last] =
        std::minmax_element(map.trajectory.stamps_s.begin(), map.trajectory.stamps_s.end());
    text += fmt::format("  ·  {:.0f} s", *last - *first);
  }
  return text;
}

std::string title_of(const std::filesystem::path& map_folder) {
  const std::filesystem::path whole = std::filesystem::weakly_canonical(map_folder);
  return whole.filename().string();
}

}  // namespace

RenderReport render_map(const std::filesystem::path& map_folder, const std::filesystem::path& png,
                        const RenderSettings& settings) {
  const Map map = open_map(map_folder, settings);
  const bool with_top = settings.view != RenderSettings::View::oblique;
  const bool with_oblique = settings.view != RenderSettings::View::top;

  // Beside each other where the map is about as high as wide, otherwise one above the other.
  const Camera top_camera = Camera::top(map.box, settings.size_px);
  const bool beside = with_top && with_oblique && 4 * top_camera.height_px() > 3 * top_camera.width_px();
  const int oblique_width_px = beside     ? top_camera.height_px() * 3 / 2
                               : with_top ? top_camera.width_px()
                                          : settings.size_px;
  const Camera oblique_camera = Camera::oblique(map.box, map.driven, map.sample, oblique_width_px,
                                                beside ? top_camera.height_px() : settings.size_px);

  RenderReport report;
  for (const Loop& loop : map.loops) ++(loop.accepted ? report.loops_accepted : report.loops_refused);

  TopImage top_image(with_top ? top_camera : Camera());
  ObliqueImage oblique_image(with_oblique ? oblique_camera : Camera());
  if (!map.ply.empty()) {
    report.points = stream_ply(map.ply, [&](std::span<const Point> points) {
      std::uint64_t finite = 0;
      for (const Point& point : points) finite += is_finite(point) ? 1U : 0U;
      report.not_finite += points.size() - finite;
      std::uint64_t inside = 0;
      if (with_oblique) inside = oblique_image.add(points);
      if (with_top) inside = top_image.add(points);
      report.outside += finite - inside;
    });
  }

  const double u = std::max(0.6, settings.size_px / 1400.0);  // the unit of all that is no map
  const int left = static_cast<int>((with_top ? 64 : 24) * u);
  const int gap = static_cast<int>((beside ? 28 : 44) * u);
  const int right = static_cast<int>(24 * u);
  const int header = static_cast<int>(92 * u);
  const int below_top = static_cast<int>((with_top ? 26 : 4) * u);
  int content_width = with_top ? top_camera.width_px() : oblique_camera.width_px();
  int content_height = with_top ? top_camera.height_px() : oblique_camera.height_px();
  double oblique_left = left;
  double oblique_top = header;
  if (beside) {
    oblique_left = left + top_camera.width_px() + gap;
    oblique_top = header + (top_camera.height_px() - oblique_camera.height_px()) / 2;
    content_width += gap + oblique_camera.width_px();
  } else if (with_top && with_oblique) {
    oblique_top = header + top_camera.height_px() + gap;
    content_height += gap + oblique_camera.height_px();
  }
  report.width_px = left + content_width + right;
  const double legend_right = left + content_width;
  Canvas measuring(1, 1);
  const int legend_rows = draw_legend(measuring, map, settings, report, left, legend_right, 0, u);
  report.height_px = header + content_height + below_top + static_cast<int>((20 + 26 * legend_rows) * u);

  Canvas canvas(report.width_px, report.height_px);
  canvas.color({background.r / 255.0, background.g / 255.0, background.b / 255.0, 1});
  cairo_paint(canvas.get());
  canvas.color(ink);
  canvas.text(left, 42 * u, 28 * u, title_of(map_folder), 0, true);
  canvas.color(faint_ink);
  canvas.text(left, 70 * u, 16 * u, subtitle(map, report));
  if (with_top) {
    canvas.paint(top_image.tone_mapped(map.height), top_camera.width_px(), left, header);
    draw_over(canvas, {top_camera, double(left), double(header), u}, map, settings, true);
  }
  if (with_oblique) {
    canvas.paint(oblique_image.tone_mapped(map.height), oblique_camera.width_px(), oblique_left, oblique_top);
    draw_over(canvas, {oblique_camera, oblique_left, oblique_top, u}, map, settings, false);
  }
  draw_legend(canvas, map, settings, report, left, legend_right, header + content_height + below_top + 26 * u,
              u);
  canvas.write_png(png);
  return report;
}

}  // namespace alces::offline
