#include "offline/render/render.h"

#include <cairo.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "offline/io/files/error.h"
#include "offline/io/map_folder/map_writer.h"
#include "temporary_folder.h"

namespace alces::offline {
namespace {

struct Image {
  explicit Image(const std::filesystem::path& png)
      : surface(cairo_image_surface_create_from_png(png.c_str()), cairo_surface_destroy) {
    REQUIRE(cairo_surface_status(surface.get()) == CAIRO_STATUS_SUCCESS);
    width = cairo_image_surface_get_width(surface.get());
    height = cairo_image_surface_get_height(surface.get());
  }
  [[nodiscard]] std::uint32_t at(int x, int y) const {
    const unsigned char* row =
        cairo_image_surface_get_data(surface.get()) + y * cairo_image_surface_get_stride(surface.get());
    std::uint32_t pixel = 0;
    std::copy_n(row + 4 * x, 4, reinterpret_cast<unsigned char*>(&pixel));
    return pixel & 0xFFFFFF;
  }
  /// Pixels for which blue, green and red are in the given relation.
  template <typename Predicate>
  [[nodiscard]] int count(Predicate predicate) const {
    int found = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const std::uint32_t pixel = at(x, y);
        if (predicate(int(pixel >> 16), int(pixel >> 8 & 0xFF), int(pixel & 0xFF))) ++found;
      }
    }
    return found;
  }

  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface;
  int width = 0;
  int height = 0;
};

bool is_accepted_green(int r, int g, int b) {
  return g > 230 && r < 100 && b > 90 && b < 140;
}
bool is_refused_red(int r, int g, int b) {
  return r > 230 && g > 50 && g < 95 && b > 50 && b < 95;
}
bool is_compared_pink(int r, int g, int b) {
  return r > 215 && g > 95 && g < 135 && b > 215;
}

/// A drive around a house, 30 m by 20 m.
void write_map(const std::filesystem::path& folder, bool with_points, const Trajectory& trajectory) {
  write_tum(folder / "trajectory.tum", trajectory);
  if (!with_points) return;
  PlyMapWriter writer(folder / "map.ply");
  std::vector<Point> points;
  for (float x = -15; x <= 15; x += 0.1F) {
    for (float y = -10; y <= 10; y += 0.1F) points.push_back({x, y, 0});
    for (float z = 0; z <= 5; z += 0.1F) points.push_back({x / 3, -3, z});
  }
  writer.add(points, Pose{}, 0);
  writer.finish();
}

Trajectory circle() {
  Trajectory trajectory;
  for (int i = 0; i <= 60; ++i) {
    const double angle_rad = 0.1 * i;
    trajectory.stamps_s.push_back(i);
    trajectory.poses.push_back(
        {Eigen::Quaterniond::Identity(), {9 * std::cos(angle_rad), 6 * std::sin(angle_rad), 0.5}});
  }
  return trajectory;
}

TEST_CASE("a map becomes a picture with its points, drive and loops") {
  const TemporaryFolder folder;
  write_map(folder.path(), true, circle());
  folder.write("run.json", R"({"loops": [{"first": 0, "last": 60, "accepted": true, "error_m": 0.1},
                                         {"first": 10, "last": 40, "accepted": false}]})");
  RenderSettings settings;
  settings.size_px = 600;
  for (const auto view :
       {RenderSettings::View::top, RenderSettings::View::oblique, RenderSettings::View::both}) {
    settings.view = view;
    const RenderReport report = render_map(folder.path(), folder / "map.png", settings);
    CHECK(report.points > 60000);
    CHECK(report.loops_accepted == 1);
    CHECK(report.loops_refused == 1);
    const Image image(folder / "map.png");
    CHECK(image.width == report.width_px);
    CHECK(image.height == report.height_px);
    CHECK(image.width > 600);
    CHECK(image.at(1, 1) == 0x0B0F17);
    CHECK(image.count(is_accepted_green) > 20);
    CHECK(image.count(is_refused_red) > 20);
    CHECK(image.count(is_compared_pink) == 0);
    const int filled = image.count([](int r, int g, int b) { return r + g + b > 90; });
    CHECK(filled > image.width * image.height / 5);
  }
}

TEST_CASE("another trajectory is drawn beside the map's, and a map without points still has its drive") {
  const TemporaryFolder folder;
  write_map(folder.path(), false, circle());
  RenderSettings settings;
  settings.size_px = 400;
  settings.compare = circle();
  settings.compare_name = "odometry";
  for (Pose& pose : settings.compare->poses) pose.translation_m.x() += 4;
  const RenderReport report = render_map(folder.path(), folder / "map.png", settings);
  CHECK(report.points == 0);
  CHECK(Image(folder / "map.png").count(is_compared_pink) > 50);
}

TEST_CASE("a single pose without points is a picture, too") {
  const TemporaryFolder folder;
  Trajectory one;
  one.stamps_s = {0};
  one.poses.resize(1);
  write_map(folder.path(), false, one);
  CHECK(render_map(folder.path(), folder / "map.png").width_px > 0);
}

TEST_CASE("what is no map is refused, and leaves no picture") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(render_map(folder.path(), folder / "map.png"), InputError);
  write_map(folder.path(), false, circle());
  for (const char* run : {"", "[]", R"({"loops": [1]})", R"({"loops": [{"first": 0, "last": 61}]})"}) {
    folder.write("run.json", run);
    CHECK_THROWS_AS(render_map(folder.path(), folder / "map.png"), InputError);
  }
  folder.write("run.json", "{}");
  for (const char* ply :
       {"", "plx\n", "ply\nformat ascii 1.0\nelement vertex 1\n",
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float "
        "y\nproperty float z\nend_header\n0123456789AB"}) {
    folder.write("map.ply", ply);
    CHECK_THROWS_AS(render_map(folder.path(), folder / "map.png"), InputError);
  }
  CHECK_FALSE(std::filesystem::exists(folder / "map.png"));
  std::filesystem::remove(folder / "map.ply");
  CHECK_THROWS_AS(render_map(folder.path(), folder / "missing" / "map.png"), OutputError);
}

}  // namespace
}  // namespace alces::offline
