// alces render: a picture of a map.
#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/program/command.h"
#include "render.h"

namespace alces::offline {
namespace {

struct RenderOptions {
  std::string map_folder;
  std::string png;
  std::string compare;
  RenderSettings settings;
  bool json = false;
};

constexpr const char* render_footer = R"(Examples:
  alces render town --out town.png                          both views
  alces render town --out top.png --view top --size 3000    from above, 3000 pixels along the longer side
  alces render town --out town.png --compare truth.tum      another trajectory over it, dashed

From above, brightness is the logarithm of the points a pixel holds and the height they span, so that walls stand out
of the ground. Colour is height. Rings mark the places where loops were closed, crossed ones where they were refused.)";

void render(RenderOptions& options) {
  const std::string extension = std::filesystem::path(options.png).extension().string();
  if (!extension.empty() && extension != ".png")
    throw UsageError(
        fmt::format("--out {}: a PNG is written; give it a name that ends in .png", options.png));
  if (!options.compare.empty()) {
    options.settings.compare = read_trajectory(options.compare);
    options.settings.compare_name = std::filesystem::path(options.compare).filename().string();
  }
  const RenderReport report = render_map(options.map_folder, options.png, options.settings);
  if (options.json) {
    const nlohmann::json json = {{"out", options.png},
                                 {"width_px", report.width_px},
                                 {"height_px", report.height_px},
                                 {"points", report.points},
                                 {"not_finite", report.not_finite},
                                 {"outside", report.outside},
                                 {"loops_accepted", report.loops_accepted},
                                 {"loops_refused", report.loops_refused}};
    fmt::print("{}\n", json_text(json));
    return;
  }
  fmt::print("{}: {} x {} pixels, {} points", options.png, report.width_px, report.height_px, report.points);
  if (report.not_finite > 0) fmt::print(", {} of them not finite and left out", report.not_finite);
  if (report.outside > 0) fmt::print(", {} beyond the frame", report.outside);
  fmt::print("\n");
}

}  // namespace

void add_render_command(CLI::App& alces) {
  using View = RenderSettings::View;
  auto options = std::make_shared<RenderOptions>();
  CLI::App* verb =
      alces.add_subcommand("render", "A picture of a map: from above and obliquely, with the drive.");
  verb->footer(render_footer);
  verb->add_option("OUT", options->map_folder, "a map folder")->required();
  verb->add_option("--out", options->png, "the PNG to write")->required();
  verb->add_option("--view", options->settings.view, "top, oblique or both")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, View>{
                                      {"top", View::top}, {"oblique", View::oblique}, {"both", View::both}})
              .description("{top|oblique|both}"))
      ->default_str("both");
  verb->add_option("--size", options->settings.size_px, "pixels along the longer side of the view from above")
      ->check(CLI::Range(200, 8192))
      ->capture_default_str();
  verb->add_option("--compare", options->compare, "another trajectory to draw beside the map's");
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] { render(*options); });
}

}  // namespace alces::offline
