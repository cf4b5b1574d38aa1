#include "static_map.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include "offline/render/render_points.h"
#include "packed_bytes.h"

namespace alces::offline {
namespace {

struct Frame {
  double left_m = 0;  // y is left: to the left of the picture when x points up; here x right, y up
  double top_m = 0;
  double px_a_metre = 1;
  int width_px = 1;
  int height_px = 1;
  double low_m = 0;  // height range
  double high_m = 1;

  [[nodiscard]] double x(double x_m) const { return (x_m - left_m) * px_a_metre; }
  [[nodiscard]] double y(double y_m) const { return (top_m - y_m) * px_a_metre; }
};

/// Dark enough for paper, light enough for a dark page: blue, teal, green, amber, red.
Rgb8 color_of(double fraction) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{59, 91, 219}, {16, 140, 170}, {47, 158, 68}, {224, 145, 10}, {210, 45, 45}}};
  const double place = std::clamp(fraction, 0.0, 1.0) * (stops.size() - 1);
  const auto stop = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  const double part = place - static_cast<double>(stop);
  const auto channel = [&](std::size_t c) {
    return static_cast<std::uint8_t>(
        std::lround((1 - part) * stops.at(stop).at(c) + part * stops.at(stop + 1).at(c)));
  };
  return {channel(0), channel(1), channel(2)};
}

Frame frame_of(const ReportMap& map, int size_px) {
  std::array<std::vector<float>, 3> axes;
  for (std::size_t i = 0; i < map.points.size(); i += 1 + map.points.size() / 500'000) {
    axes[0].push_back(map.points[i].position.x);
    axes[1].push_back(map.points[i].position.y);
    axes[2].push_back(map.points[i].position.z);
  }
  Eigen::Vector3d low = map.trajectory.poses.front().translation_m;
  Eigen::Vector3d high = low;
  for (const Pose& pose : map.trajectory.poses) {
    low = low.cwiseMin(pose.translation_m);
    high = high.cwiseMax(pose.translation_m);
  }
  Frame frame;
  frame.low_m = low.z() - 1;
  frame.high_m = high.z() + 1;
  if (!axes[0].empty()) {
    frame.low_m = quantile(axes[2], 0.02);
    frame.high_m = quantile(axes[2], 0.98);
    for (std::size_t a = 0; a < 2; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      low(axis) = std::min(low(axis), quantile(axes.at(a), 0.005));
      high(axis) = std::max(high(axis), quantile(axes.at(a), 0.995));
    }
  }
  const double margin_m = std::max(1.0, 0.02 * (high - low).head<2>().maxCoeff());
  const double width_m = high.x() - low.x() + 2 * margin_m;
  const double height_m = high.y() - low.y() + 2 * margin_m;
  frame.left_m = low.x() - margin_m;
  frame.top_m = high.y() + margin_m;
  frame.px_a_metre = size_px / std::max(width_m, height_m);
  frame.width_px = std::max(240, static_cast<int>(width_m * frame.px_a_metre));
  frame.height_px = std::max(240, static_cast<int>(height_m * frame.px_a_metre));
  return frame;
}

cairo_status_t append_png(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

std::string points_png(const ReportMap& map, const Frame& frame) {
  struct Pixel {
    std::uint32_t count = 0;
    float sum_m = 0;
    float low_m = 1e30F;
    float high_m = -1e30F;
  };
  std::vector<Pixel> pixels(static_cast<std::size_t>(frame.width_px) *
                            static_cast<std::size_t>(frame.height_px));
  for (const CloudPoint& point : map.points) {
    const double x = frame.x(static_cast<double>(point.position.x));
    const double y = frame.y(static_cast<double>(point.position.y));
    if (!(x >= 0 && y >= 0 && x < frame.width_px && y < frame.height_px)) continue;
    Pixel& pixel = pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width_px) +
                          static_cast<std::size_t>(x)];
    ++pixel.count;
    pixel.sum_m += point.position.z;
    pixel.low_m = std::min(pixel.low_m, point.position.z);
    pixel.high_m = std::max(pixel.high_m, point.position.z);
  }
  std::vector<float> counts;
  for (const Pixel& pixel : pixels)
    if (pixel.count > 0) counts.push_back(static_cast<float>(pixel.count));
  const double full = counts.empty() ? 1 : std::max(quantile(counts, 0.97), 2.0);

  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, frame.width_px, frame.height_px),
      cairo_surface_destroy);
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) throw std::bad_alloc();
  unsigned char* const data = cairo_image_surface_get_data(surface.get());
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get()));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Pixel& pixel = pixels[i];
    if (pixel.count == 0) continue;
    // Walls stand out of the ground by the height that they span.
    const double many = std::log1p(pixel.count) / std::log1p(full);
    const double upright = std::min(1.0, static_cast<double>(pixel.high_m - pixel.low_m) / 3);
    const double alpha = std::clamp(0.08 + 0.35 * many + 0.6 * upright, 0.0, 1.0);
    const double mean_m = static_cast<double>(pixel.sum_m) / pixel.count;
    const Rgb8 color = color_of((mean_m - frame.low_m) / std::max(frame.high_m - frame.low_m, 1e-6));
    // 16 steps a channel: a PNG of half the size, and nobody sees it.
    const auto quantised = [](double value) { return std::round(value * 16) / 16; };
    const double a = quantised(alpha);
    const auto channel = [&](double value) {
      return static_cast<std::uint32_t>(std::lround(255 * a * quantised(value / 255)));
    };
    const std::uint32_t argb = static_cast<std::uint32_t>(std::lround(255 * a)) << 24 |
                               channel(color.r) << 16 | channel(color.g) << 8 | channel(color.b);
    const std::size_t row = i / static_cast<std::size_t>(frame.width_px);
    const std::size_t column = i % static_cast<std::size_t>(frame.width_px);
    std::memcpy(data + row * stride + 4 * column, &argb, 4);
  }
  cairo_surface_mark_dirty(surface.get());
  std::string png;
  if (cairo_surface_write_to_png_stream(surface.get(), append_png, &png) != CAIRO_STATUS_SUCCESS)
    throw std::bad_alloc();
  return png;
}

std::string path_of(const Trajectory& trajectory, const Frame& frame) {
  std::string path;
  const std::size_t every = 1 + trajectory.size() / 3000;
  for (std::size_t i = 0; i < trajectory.size(); i += every) {
    const Eigen::Vector3d& at = trajectory.poses[i].translation_m;
    path += fmt::format("{}{:.1f},{:.1f}", i == 0 ? "" : " ", frame.x(at.x()), frame.y(at.y()));
  }
  return path;
}

double round_length_m(double about_m) {
  const double power = std::pow(10, std::floor(std::log10(about_m)));
  for (const double step : {5.0, 2.0})
    if (step * power <= about_m) return step * power;
  return power;
}

}  // namespace

std::string static_map_svg(const ReportMap& map, int width_px) {
  const Frame frame = frame_of(map, width_px);
  const double scale_m = round_length_m(0.25 * frame.width_px / frame.px_a_metre);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" role=\"img\" aria-label=\"The map from above, with the drive and its "
      "loops\">"
      "<image width=\"{0}\" height=\"{1}\" href=\"data:image/png;base64,{2}\"/>",
      frame.width_px, frame.height_px, base64(points_png(map, frame)));
  if (map.without_loops)
    svg += fmt::format("<polyline class=\"map-before\" points=\"{}\"/>", path_of(*map.without_loops, frame));
  svg += fmt::format("<polyline class=\"map-after\" points=\"{}\"/>", path_of(map.trajectory, frame));
  for (const nlohmann::json& loop : map.run["loops"]) {
    const Eigen::Vector3d& first = map.trajectory.poses[loop["first"].get<std::size_t>()].translation_m;
    const Eigen::Vector3d& last = map.trajectory.poses[loop["last"].get<std::size_t>()].translation_m;
    const bool accepted = loop.contains("accepted") && loop["accepted"] == true;
    svg += fmt::format(
        "<g class=\"{}\"><line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/><circle "
        "cx=\"{:.1f}\" "
        "cy=\"{:.1f}\" r=\"6\"/></g>",
        accepted ? "map-closed" : "map-refused", frame.x(first.x()), frame.y(first.y()), frame.x(last.x()),
        frame.y(last.y()), frame.x((first.x() + last.x()) / 2), frame.y((first.y() + last.y()) / 2));
  }
  const double length_px = scale_m * frame.px_a_metre;
  const int bottom = frame.height_px - 14;
  svg += fmt::format(
      "<g class=\"map-scale\"><path d=\"M16 {0}v6h{1:.1f}v-6\"/><text x=\"{2:.1f}\" y=\"{3}\">{4:g} "
      "m</text></g>"
      "</svg>",
      bottom - 6, length_px, 16 + length_px / 2, bottom - 8, scale_m);
  return svg;
}

}  // namespace alces::offline
