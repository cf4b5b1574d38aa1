// Registering one pair of real scans from bad starts: how many of 200 arrive within 2 cm and 0.2 deg, and how
// fast. A start is an offset of up to 1 m and 10 deg on the identity, or on the truth. Peer: PCL's GICP from
// the first few of the same starts.
#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces_platform/sim/random.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "support.h"
#include "support/registration.h"
#ifdef ALCES_HAS_PCL
#include "pcl_match.h"
#endif

namespace {

using namespace alces;
using namespace alces::bench;

struct Settings {
  std::string source, target, truth;
  std::size_t starts = 200;
  std::size_t peer_starts = 20;
  std::uint64_t seed = 1;
  double most_m = 1;
  double most_deg = 10;
};

std::vector<Point> read_points(const std::string& file) {
  offline::ScanPoints scan;
  offline::open_scans(file)->read(0, scan);
  return scan.points;
}

struct Tally {
  std::size_t count = 0;
  std::size_t arrived = 0;
  Samples ms, iterations, arrived_cm, arrived_deg;

  void add(const Pose& found, const Pose& truth, double time_ms, std::uint32_t iteration_count) {
    const double cm = 100 * (found.translation_m - truth.translation_m).norm();
    const double deg = angle_between_rad(found.rotation, truth.rotation) * 180 / std::numbers::pi;
    ++count;
    ms.add(time_ms);
    iterations.add(iteration_count);
    if (cm > 2 || deg > 0.2) return;
    ++arrived;
    arrived_cm.add(cm);
    arrived_deg.add(deg);
  }
  void print(const std::string& method, const std::string& starts) const {
    print_row({method, starts, fmt::format("{} of {}", arrived, count),
               fmt::format("{:.1f} ({:.1f})", ms.median(), ms.worst()),
               iterations.worst() > 0
                   ? fmt::format("{:.0f} ({:.0f})", iterations.median(), iterations.worst())
                   : "-",
               fmt::format("{:.2f} ({:.2f})", arrived_cm.median(), arrived_cm.worst()),
               fmt::format("{:.3f} ({:.3f})", arrived_deg.median(), arrived_deg.worst())});
  }
};

void measure(const Settings& settings) {
  print_heading("Registration of a real pair from bad starts");
  const std::vector<Point> source = read_points(settings.source);
  const std::vector<Point> target = read_points(settings.target);
  const offline::Trajectory truths = offline::read_trajectory(settings.truth);
  if (truths.size() != 1) throw std::runtime_error(settings.truth + ": one 4x4 matrix is wanted");
  const Pose truth = truths.poses.front();

  const Stopwatch preparing;
  test::Registration registration(target, source);
  const double prepare_ms = preparing.ms();
  fmt::print(
      "{} and {} points, {} and {} after reduction; reducing, trees and surface: {:.1f} ms, not in the "
      "times below. Starts are up to {} m and {} deg off.\n\n",
      source.size(), target.size(), registration.source().size(), registration.target().size(), prepare_ms,
      settings.most_m, settings.most_deg);
  print_header({"median (worst)", "start", "within 2 cm, 0.2 deg", "time, ms", "iterations",
                "error of these, cm", "deg"});

  const auto try_all = [&](const Pose& base, std::size_t starts, const std::string& method,
                           const std::string& from, const std::function<void(const Pose&, Tally&)>& attempt) {
    sim::Random random(settings.seed);
    Tally tally;
    for (std::size_t i = 0; i < starts; ++i) {
      print_progress(i, starts);
      attempt(base * test::random_offset(random, settings.most_m, settings.most_deg), tally);
    }
    print_progress(1, 1);
    tally.print(method, from);
  };
  const auto ours = [&](const Pose& start, Tally& tally) {
    const Stopwatch watch;
    const IcpResult result = registration.match(start);
    tally.add(result.model_from_data, truth, watch.ms(), result.iterations);
  };
  Tally identity;
  ours(Pose{}, identity);
  identity.print("alces", "identity");
  try_all(Pose{}, settings.starts, "alces", "identity and an offset", ours);
  try_all(truth, settings.starts, "alces", "truth and an offset", ours);
#ifdef ALCES_HAS_PCL
  const auto peer = [&](const Pose& start, Tally& tally) {
    const PclMatch match = pcl_match(PclMethod::gicp, registration.target(), registration.source(), start,
                                     3.0, 50, 0.001, 0.001);
    tally.add(match.model_from_data, truth, match.ms, 0);
  };
  const std::string method = "PCL " + pcl_version() + " GICP, limit 3 m";
  Tally from_identity;
  peer(Pose{}, from_identity);
  from_identity.print(method, "identity");
  try_all(Pose{}, std::min(settings.starts, settings.peer_starts), method, "identity and an offset", peer);
  fmt::print("\nPCL's times include its trees and covariances.\n");
#endif
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("One pair of real scans registered from many bad starts");
  Settings settings;
  app.add_option("--source", settings.source, "Scan file")->required()->check(CLI::ExistingFile);
  app.add_option("--target", settings.target, "Scan file")->required()->check(CLI::ExistingFile);
  app.add_option("--truth", settings.truth, "target_from_source, a 4x4 matrix")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--starts", settings.starts, "Random starts")->capture_default_str();
  app.add_option("--peer-starts", settings.peer_starts, "Of these for PCL, which is slow")
      ->capture_default_str();
  app.add_option("--seed", settings.seed, "Of the starts")->capture_default_str();
  app.add_option("--offset", settings.most_m, "Largest, m")->capture_default_str();
  app.add_option("--turn", settings.most_deg, "Largest, deg")->capture_default_str();
  return run(argc, argv, app, [&] { measure(settings); });
}
