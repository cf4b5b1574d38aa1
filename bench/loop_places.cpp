// Loops that are not there: many made-up places are driven through, false and true loops are offered, and
// what the mapper makes of them is counted.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "alces_platform/settings/mapper_settings.h"
#include "places/place_trial.h"
#include "support.h"

namespace {

using namespace alces;
using namespace alces::bench;
using namespace alces::places;

struct Options {
  std::vector<std::string> kinds;
  std::vector<std::string> scanners;
  std::vector<double> noises{1, 3};
  std::uint64_t first_seed = 1;
  std::uint64_t seeds = 8;
  std::size_t pairs = 4;
  std::string settings_file;
  std::string json;
  std::string dump;
  std::vector<std::string> drives;  ///< NAME=SCANS:REFERENCE[:FIRST-LAST]
};

/// Of all trials of one kind and noise.
struct Tally {
  std::size_t drives = 0, others = 0, others_taken = 0, off = 0;
  std::size_t revisits = 0, revisits_taken = 0, bare = 0, bare_taken = 0;  ///< those on bare ground apart
  std::size_t own_offered = 0, own_taken = 0, own_off = 0;
  std::size_t worse = 0;
  Samples without_m, with_m;

  void add(const Trial& trial) {
    ++drives;
    for (const TriedLoop& loop : trial.offered) {
      if (loop.is_off()) ++off;
      const bool is_right = loop.is_recognised() && !loop.is_off();
      if (!loop.is_revisit) {
        ++others;
        if (loop.is_recognised()) ++others_taken;
      } else if (loop.is_bare) {
        ++bare;
        if (is_right) ++bare_taken;
      } else {
        ++revisits;
        if (is_right) ++revisits_taken;
      }
    }
    for (const TriedLoop& loop : trial.own) {
      ++own_offered;
      if (loop.is_taken()) ++own_taken;
      if (loop.is_off()) ++own_off;
    }
    if (trial.is_worse()) ++worse;
    without_m.add(trial.error_without_m);
    with_m.add(trial.error_with_m);
  }
};

nlohmann::json to_json(const TriedLoop& loop) {
  const LoopReport& report = loop.report;
  return {{"first", report.first},
          {"last", report.last},
          {"revisit", loop.is_revisit},
          {"bare", loop.is_bare},
          {"verdict", to_string(report.verdict)},
          {"distance_m", report.distance_m},
          {"overlap", report.overlap},
          {"rms_m", report.rms_m},
          {"wall_fit", report.wall_fit},
          {"mahalanobis2", report.mahalanobis2},
          {"correction_m", report.correction_m},
          {"correction_deg", report.correction_rad * 57.29577951308232},
          {"needed_m", loop.before_from_after.translation_m.norm()},
          {"needed_deg", angle_between_rad(loop.before_from_after.rotation, Eigen::Quaterniond::Identity()) *
                             57.29577951308232},
          {"off_m", loop.off_m},
          {"off_deg", loop.off_rad * 57.29577951308232},
          {"is_off", loop.is_off()},
          {"map_error_m", loop.map_error_m}};
}

void write_ply(const std::filesystem::path& path, const std::vector<Point>& points) {
  std::ofstream file(path, std::ios::binary);
  file << fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "end_header\n",
      points.size());
  static_assert(sizeof(Point) == 3 * sizeof(float));
  file.write(reinterpret_cast<const char*>(points.data()),
             static_cast<std::streamsize>(points.size() * sizeof(Point)));
  if (!file.flush()) throw std::runtime_error(path.string() + " cannot be written");
}

void write_tum(const std::filesystem::path& path, const std::vector<Pose>& poses) {
  std::ofstream file(path);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& t = poses[i].translation_m;
    const Eigen::Quaterniond& q = poses[i].rotation;
    file << fmt::format("{} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", i, t.x(), t.y(), t.z(),
                        q.x(), q.y(), q.z(), q.w());
  }
  if (!file.flush()) throw std::runtime_error(path.string() + " cannot be written");
}

void dump(const PlaceDrive& drive, double noise, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < drive.scans.size(); ++i)
    write_ply(folder / fmt::format("scan{:03}.ply", i), drive.scans[i]);
  write_tum(folder / "truth.tum", drive.truth);
  write_tum(folder / "odometry.tum", drive.odometry(noise));
}

std::string share(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{} of {} ({:.0f} %)", part, whole,
                                  100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

void print_tally(const std::string& kind, double noise, const Tally& tally) {
  print_row({kind, fmt::format("{:g}", noise), fmt::format("{}", tally.drives),
             fmt::format("{} / {}", tally.others, tally.others_taken), fmt::format("{}", tally.off),
             share(tally.revisits_taken, tally.revisits), share(tally.bare_taken, tally.bare),
             fmt::format("{} / {} / {}", tally.own_offered, tally.own_taken, tally.own_off),
             fmt::format("{:.3f} / {:.3f}", tally.without_m.mean(), tally.with_m.mean()),
             fmt::format("{}", tally.worse)});
}

void print_heads() {
  print_header({"kind", "noise", "drives", "different: offered / taken", "off", "revisits taken",
                "on bare ground", "own: offered / taken / off", "error without / with, m", "worse"});
}

std::vector<Kind> wanted_kinds(const Options& options) {
  if (options.kinds.empty()) return {std::begin(all_kinds), std::end(all_kinds)};
  std::vector<Kind> kinds;
  for (const std::string& name : options.kinds) {
    const std::optional<Kind> kind = kind_named(name);
    if (!kind) throw std::runtime_error(name + " is no kind of place");
    kinds.push_back(*kind);
  }
  return kinds;
}

std::vector<Scanner> wanted_scanners(const Options& options) {
  if (options.scanners.empty()) return {std::begin(all_scanners), std::end(all_scanners)};
  std::vector<Scanner> scanners;
  for (const std::string& name : options.scanners) {
    const std::optional<Scanner> scanner = scanner_named(name);
    if (!scanner) throw std::runtime_error(name + " is no scanner");
    scanners.push_back(*scanner);
  }
  return scanners;
}

class Results {
 public:
  void add(const std::string& row, double noise, const Trial& trial, nlohmann::json one) {
    rows_[{row, noise}].add(trial);
    all_[noise].add(trial);
    one["noise"] = noise;
    one["predicted"] = trial.predicted;
    one["error_without_m"] = trial.error_without_m;
    one["error_with_m"] = trial.error_with_m;
    one["worse"] = trial.is_worse();
    one["offered"] = nlohmann::json::array();
    one["own"] = nlohmann::json::array();
    for (const TriedLoop& loop : trial.offered) one["offered"].push_back(to_json(loop));
    for (const TriedLoop& loop : trial.own) one["own"].push_back(to_json(loop));
    cases_.push_back(std::move(one));
  }
  /// Prints what was added since the last time.
  void print_rows(const std::string& json_file) {
    for (const auto& [key, tally] : rows_) print_tally(key.first, key.second, tally);
    rows_.clear();
    if (!json_file.empty()) std::ofstream(json_file) << cases_.dump(1) << '\n';
  }
  void print_sum() const {
    for (const auto& [noise, tally] : all_) print_tally("all", noise, tally);
  }

 private:
  std::map<std::pair<std::string, double>, Tally> rows_;
  std::map<double, Tally> all_;
  nlohmann::json cases_ = nlohmann::json::array();
};

MapperConfig config_for(std::size_t scans, const Options& options) {
  MapperConfig config = place_config(scans);
  if (!options.settings_file.empty()) settings::read_mapper_settings(options.settings_file, config);
  return config;
}

void try_places(Kind kind, const Options& options, Results& results) {
  for (std::uint64_t seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
    for (const Scanner scanner : wanted_scanners(options)) {
      const PlaceDrive drive = drive_through(make_place(kind, seed), scanner, options.pairs);
      for (const double noise : options.noises) {
        if (!options.dump.empty()) {
          dump(drive, noise,
               std::filesystem::path(options.dump) /
                   fmt::format("{}-{}-{}-x{:g}", name(kind), seed, name(scanner), noise));
          continue;
        }
        const Trial trial = try_mapper(drive, noise, config_for(drive.truth.size(), options));
        results.add(std::string(name(kind)), noise, trial,
                    {{"kind", name(kind)},
                     {"what", drive.place.what},
                     {"seed", seed},
                     {"scanner", name(scanner)},
                     {"scans", drive.truth.size()}});
      }
    }
  }
}

/// A drive that others have recorded, or a part of it, and where its scans were as far as that is known.
void try_drive(const std::string& text, const Options& options, Results& results) {
  const std::size_t equals = text.find('=');
  const std::size_t colon = text.find(':', equals);
  if (equals == std::string::npos || colon == std::string::npos)
    throw std::runtime_error(text + ": a drive is named as NAME=SCANS:REFERENCE[:FIRST-LAST]");
  const std::string drive_name = text.substr(0, equals);
  const std::size_t range = text.find(':', colon + 1);
  const Drive drive = recorded(text.substr(equals + 1, colon - equals - 1), SIZE_MAX,
                               text.substr(colon + 1, range - colon - 1));
  std::size_t first = 0;
  std::size_t end = drive.size;
  if (range != std::string::npos) {
    const std::size_t dash = text.find('-', range);
    first = std::stoul(text.substr(range + 1));
    if (dash == std::string::npos || (end = std::stoul(text.substr(dash + 1)) + 1) > drive.size ||
        first >= end)
      throw std::runtime_error(text + ": no such range of scans");
  }
  std::vector<std::vector<Point>> scans(end - first);
  std::vector<Pose> odometry;
  std::vector<Pose> truth;
  for (std::size_t i = first; i < end; ++i) {
    drive.points(i, scans[i - first]);
    odometry.push_back(drive.odometry[i]);
    truth.push_back(drive.truth[first].inverse() * drive.truth[i]);
  }
  PairRules rules;
  rules.most = 5 * options.pairs;
  rules.nearest_other_m = 4;
  rules.revisit_way_m = 60;
  rules.seed = options.first_seed;
  const std::vector<Pair> pairs = choose_pairs(truth, rules);
  for (const double noise : options.noises) {
    const std::vector<Pose> worse = disturbed(odometry, noise, options.first_seed);
    Feed feed;
    feed.points = [&](std::size_t scan) -> std::span<const Point> { return scans[scan]; };
    feed.odometry = worse;
    feed.truth = truth;
    feed.pairs = pairs;
    feed.offer_with_loops = true;
    MapperConfig config = config_for(scans.size(), options);
    config.pool_bytes = std::size_t{256} << 20;
    results.add(drive_name, noise, try_mapper(feed, config),
                {{"kind", drive_name}, {"seed", options.first_seed}, {"scans", scans.size()}});
  }
}

void measure(const Options& options) {
  Results results;
  print_heading("Loops that are not there");
  print_heads();
  const bool drives_only = !options.drives.empty() && options.kinds.empty();
  for (const Kind kind : drives_only ? std::vector<Kind>{} : wanted_kinds(options)) {
    try_places(kind, options, results);
    results.print_rows(options.json);
  }
  for (const std::string& drive : options.drives) {
    try_drive(drive, options, results);
    results.print_rows(options.json);
  }
  results.print_sum();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Places where loops may be closed wrongly: what the mapper makes of false and true ones");
  Options options;
  app.add_option("--kind", options.kinds,
                 "streets, corridors, roundabout, field, pass, aisles, pillars, floors, yards; all");
  app.add_option("--scanner", options.scanners, "turning, rings16, rings64; all");
  app.add_option("--noise", options.noises, "Times the odometry is as wrong as it is")->capture_default_str();
  app.add_option("--seed", options.first_seed, "The first one")->capture_default_str();
  app.add_option("--seeds", options.seeds, "Places of each kind")->capture_default_str();
  app.add_option("--pairs", options.pairs, "Offered of a drive: different places, and as many revisits")
      ->capture_default_str();
  app.add_option("--config", options.settings_file, "Settings of the mapper, as alces map takes them");
  app.add_option(
      "--drive", options.drives,
      "NAME=SCANS:REFERENCE[:FIRST-LAST], recorded scans and where they were; without --kind these alone");
  app.add_option("--json", options.json, "File to write: every case and every loop");
  app.add_option("--dump", options.dump,
                 "Folder: write the drives as PLY scans, odometry.tum, truth.tum, and map nothing");
  return alces::bench::run(argc, argv, app, [&] { measure(options); });
}
