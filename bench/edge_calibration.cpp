// How far the variances of the edges tell the truth: drives with a known truth are mapped without loops, and
// the error of every step, and of chains of steps, is compared with what the edges' labels predict.
#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces/mapper.h"
#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/memory_plan.h"
#include "chain_errors.h"
#include "places/place_drive.h"
#include "support.h"

namespace {

using namespace alces;
using namespace alces::bench;

struct Options {
  std::vector<std::string> folders;  ///< NAME=SCANS:TRUTH
  std::vector<std::uint64_t> towns;
  std::vector<std::string> kinds;
  std::uint64_t seeds = 1;
  std::size_t returned_points = 15800;
  std::size_t most_scans = 924;
  std::string settings_file;
  bool fits = false;
};

MatchedDrive match(const Drive& drive, const Options& options) {
  MapperConfig config = settings::default_mapper_settings();
  if (!options.settings_file.empty()) settings::read_mapper_settings(options.settings_file, config);
  config.scan_capacity = static_cast<std::uint32_t>(drive.size);
  config.close_loops = false;
  const settings::MemoryPlan plan = settings::plan_memory(config, std::size_t{1} << 30);
  const settings::MemoryBlock block(plan.block_bytes);
  Status status = Status::ok;
  Mapper* const mapper = Mapper::create(block.bytes(), config, status);
  if (mapper == nullptr) throw std::runtime_error(to_string(status));
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size; ++i) {
    print_progress(i, drive.size);
    drive.points(i, points);
    ScanReport report;
    status = mapper->add_scan(points, drive.odometry.empty() ? nullptr : &drive.odometry[i], report);
    if (status != Status::ok && status != Status::no_voxel_capacity)
      throw std::runtime_error(to_string(status));
  }
  print_progress(1, 1);
  const std::span<const Edge> edges = mapper->graph().edges();
  const std::span<const Pose> poses = mapper->graph().poses();
  MatchedDrive matched;
  matched.name = drive.name;
  matched.group = drive.name;
  matched.edges = {edges.begin(), edges.end()};
  matched.poses = {poses.begin(), poses.end()};
  matched.truth = drive.truth;
  return matched;
}

Drive from_place(places::Kind kind, std::uint64_t seed, places::Scanner scanner) {
  const auto made =
      std::make_shared<places::PlaceDrive>(places::drive_through(places::make_place(kind, seed), scanner, 0));
  Drive drive;
  drive.size = made->truth.size();
  drive.name = fmt::format("{} {}, {}", places::name(kind), seed, places::name(scanner));
  drive.points = [made](std::size_t index, std::vector<Point>& points) { points = made->scans[index]; };
  drive.odometry = made->odometry(1);
  drive.truth = made->truth;
  return drive;
}

std::string cell(const ChainErrors::Nees& nees) {
  return nees.chains == 0 ? "" : fmt::format("{:.2f} / {:.2f}", nees.translation, nees.rotation);
}

void print_row_of(const ChainErrors& drive, const LabelFit& fit) {
  fmt::print("| {} ", drive.name());
  for (std::size_t length = 0; length < chain_lengths.size(); ++length)
    fmt::print("| {} ", cell(drive.nees(length, fit)));
  fmt::print("|\n");
}

void print_table(std::span<const ChainErrors> drives, const LabelFit& fit, const std::string& group = {}) {
  print_header({"NEES / dof, translation / rotation", "1 step", "5", "20", "50", "100", "200"});
  for (const ChainErrors& drive : drives) {
    if (group.empty() || drive.group() == group) print_row_of(drive, fit);
  }
  fmt::print("\n");
}

/// A part that is nothing, in mm or mrad.
std::string thousandths(double squared) {
  const double value = 1e3 * std::sqrt(squared);
  return value < 1e-3 ? "0" : fmt::format("{:.2g}", value);
}

std::string described(const LabelFit& fit) {
  const auto& v = fit.value;
  return fmt::format(
      "label x {:.2g} (translation), x {:.2g} (rotation), + {} mm and {} mrad a step, + {} mm and {} mrad a "
      "metre "
      "always the same way, + {:.2g} times the last step at the end",
      v[LabelFit::translation], v[LabelFit::rotation], thousandths(v[LabelFit::step_m2]),
      thousandths(v[LabelFit::step_rad2]), thousandths(v[LabelFit::way_m2]),
      thousandths(v[LabelFit::way_rad2]), v[LabelFit::ends]);
}

void measure(const Options& options) {
  std::vector<ChainErrors> drives;
  const auto add = [&](const Drive& drive, const std::string& group) {
    MatchedDrive matched = match(drive, options);
    matched.group = group;
    drives.emplace_back(matched);
  };
  for (const std::uint64_t seed : options.towns) {
    Drive drive = town(seed, options.most_scans, options.returned_points);
    drive.name = fmt::format("town {}", seed);
    add(drive, "town");
  }
  for (const std::string& text : options.folders) {
    const std::size_t equals = text.find('=');
    const std::size_t colon = text.find(':', equals);
    if (equals == std::string::npos || colon == std::string::npos)
      throw std::runtime_error(text + ": a drive is named as NAME=SCANS:TRUTH");
    const std::string name = text.substr(0, equals);
    Drive drive =
        recorded(text.substr(equals + 1, colon - equals - 1), options.most_scans, text.substr(colon + 1));
    drive.name = name;
    add(drive, name);
  }
  for (const std::string& wanted : options.kinds) {
    for (const places::Kind kind : places::all_kinds) {
      if (wanted != "all" && wanted != places::name(kind)) continue;
      for (std::uint64_t seed = 1; seed <= options.seeds; ++seed) {
        for (const places::Scanner scanner : places::all_scanners)
          add(from_place(kind, seed, scanner), std::string(places::name(scanner)));
      }
    }
  }
  if (drives.empty())
    throw std::runtime_error("no drive is named; --town 1, --place all or --drive NAME=SCANS:TRUTH");

  print_heading("Edges' labels against the truth, as they are");
  print_table(drives, LabelFit{});
  print_header({"single steps: rms of error / label", "x", "y", "z", "rotation"});
  for (const ChainErrors& drive : drives) {
    const Eigen::Vector4d r = drive.step_ratios();
    print_row({drive.name(), fmt::format("{:.2f}", r[0]), fmt::format("{:.2f}", r[1]),
               fmt::format("{:.2f}", r[2]), fmt::format("{:.2f}", r[3])});
  }
  if (!options.fits) return;
  const LabelFit fit = fit_labels(drives);
  fmt::print("\nBest over all drives: {}\n\n", described(fit));
  print_table(drives, fit);
  std::set<std::string> groups;
  for (const ChainErrors& drive : drives) groups.insert(drive.group());
  if (groups.size() < 2) return;
  for (const std::string& group : groups) {
    const LabelFit others = fit_labels(drives, group);
    fmt::print("Without {}: {}; then {} has\n\n", group, described(others), group);
    print_table(drives, others, group);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How well the edges' variances predict the errors of steps and of chains of steps");
  Options options;
  app.add_option("--town", options.towns, "Seeds of towns to drive through");
  app.add_option("--place", options.kinds,
                 "Made-up places (all, or a kind), with each of the three scanners");
  app.add_option("--seeds", options.seeds, "Places of each kind")->capture_default_str();
  app.add_option("--drive", options.folders,
                 "NAME=SCANS:TRUTH, a folder of scans with odometry, and a trajectory");
  app.add_option("--returned-points", options.returned_points, "Of a scan of the town, about")
      ->capture_default_str();
  app.add_option("--scans", options.most_scans, "At most, of each drive")->capture_default_str();
  app.add_option("--config", options.settings_file, "Settings of the mapper, as alces map takes them");
  app.add_flag("--fit", options.fits,
               "Which factors and floors would make labels right; also with each group left out");
  return alces::bench::run(argc, argv, app, [&] { measure(options); });
}
