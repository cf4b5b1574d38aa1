// Our ICP beside PCL's ICP and GICP: neighbouring scans of a drive, the same reduced points, the same start
// (odometry), the same distance limit and the same most iterations. Times include indices, normals and
// covariances. The error is measured on the unreduced scans: the median distance along the normals of the
// surfaces (the consistency figure of `alces evaluate`), and against the truth where it is known.
#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "alces/icp.h"
#include "alces/kd_tree.h"
#include "alces/mapper.h"
#include "alces/surface.h"
#include "offline/evaluate/evaluation.h"
#include "support.h"
#include "support/in_block.h"
#ifdef ALCES_HAS_PCL
#include "pcl_match.h"
#endif

namespace {

using namespace alces;
using namespace alces::bench;

struct Settings {
  std::size_t pairs = 60;
  float cell_size_m = 0.10F;
  float distance_limit_m = 1.0F;
  int iterations = 50;
  double translation_epsilon_m = 0.001;
  double rotation_epsilon_rad = 0.001;
};

struct Match {
  Pose model_from_data;
  double ms = 0;
  std::uint32_t iterations = 0;
};

using Matcher =
    std::function<Match(std::span<const Point> model, std::span<const Point> data, const Pose& start)>;

class Ours {
 public:
  static constexpr std::uint32_t capacity = 1U << 18;

  Ours()
      : model_tree_(capacity),
        data_tree_(capacity),
        scratch_(capacity),
        icp_(capacity),
        model_samples_(capacity),
        samples_(capacity) {}

  /// What the paper does with all points: no normals needed.
  Match all_points(std::span<const Point> model, std::span<const Point> data, const Pose& start,
                   const IcpConfig& config) {
    const Stopwatch watch;
    build(model, data);
    for (std::uint32_t i = 0; i < data_tree_->size(); ++i) samples_[i].index = i;
    return match(0, data_tree_->size(), start, config, watch);
  }

  Match samples(std::span<const Point> model, std::span<const Point> data, const Pose& start,
                const IcpConfig& config, const SurfaceConfig& surface) {
    const Stopwatch watch;
    build(model, data);
    const std::uint32_t of_model = sample(*model_tree_, surface, model_samples_);
    return match(of_model, sample(*data_tree_, surface, samples_), start, config, watch);
  }

 private:
  static std::uint32_t sample(const KdTree& tree, const SurfaceConfig& surface,
                              std::span<SurfaceSample> samples) {
    return sample_surface(tree, surface, measure_spacing(tree, surface.neighbors), samples);
  }
  void build(std::span<const Point> model, std::span<const Point> data) {
    if (!model_tree_->build(model, *scratch_) || !data_tree_->build(data, *scratch_))
      throw std::runtime_error("a scan is larger than the tree's capacity");
  }
  Match match(std::uint32_t of_model, std::uint32_t of_data, const Pose& start, const IcpConfig& config,
              const Stopwatch& watch) {
    const IcpScan model[1] = {{&*model_tree_, std::span(model_samples_).first(of_model), Pose{}}};
    const IcpScan data[1] = {{&*data_tree_, std::span(samples_).first(of_data), Pose{}}};
    const IcpResult result = icp_->match(model, data, start, config);
    return {result.model_from_data, watch.ms(), result.iterations};
  }

  test::InBlock<KdTree> model_tree_, data_tree_;
  test::InBlock<KdTreeScratch> scratch_;
  test::InBlock<Icp> icp_;
  std::vector<SurfaceSample> model_samples_, samples_;
};

struct Candidate {
  std::string name;
  Matcher match;
  Samples ms, iterations, residual_cm, error_cm, error_deg;
};

std::vector<Candidate> candidates(Ours& ours, const Settings& settings) {
  const MapperConfig standard = MapperConfig::standard();
  IcpConfig plain = MapperConfig::paper().scan_match;
  plain.maximum_iterations = static_cast<std::uint32_t>(settings.iterations);
  plain.first_distance_limit_m = plain.last_distance_limit_m = settings.distance_limit_m;
  plain.translation_epsilon_m = static_cast<float>(settings.translation_epsilon_m);
  plain.rotation_epsilon_rad = static_cast<float>(settings.rotation_epsilon_rad);
  plain.coarse_stride = 1;
  IcpConfig surface = standard.scan_match;
  surface.maximum_iterations = static_cast<std::uint32_t>(settings.iterations);
  surface.first_distance_limit_m = std::min(surface.first_distance_limit_m, settings.distance_limit_m);
  surface.last_distance_limit_m = std::min(surface.last_distance_limit_m, settings.distance_limit_m);

  std::vector<Candidate> all;
  const auto add = [&](std::string name, Matcher match) {
    Candidate candidate;
    candidate.name = std::move(name);
    candidate.match = std::move(match);
    all.push_back(std::move(candidate));
  };
  add("odometry alone", [](auto, auto, const Pose& start) { return Match{start, 0, 0}; });
  add("alces, point-to-point, all points", [&ours, plain](auto model, auto data, const Pose& start) {
    return ours.all_points(model, data, start, plain);
  });
  add("alces, point-to-point, samples",
      [&ours, plain, sampling = standard.surface](auto model, auto data, const Pose& start) {
        return ours.samples(model, data, start, plain, sampling);
      });
  add("alces, default",
      [&ours, surface, sampling = standard.surface](auto model, auto data, const Pose& start) {
        return ours.samples(model, data, start, surface, sampling);
      });
#ifdef ALCES_HAS_PCL
  for (const PclMethod method : {PclMethod::icp, PclMethod::gicp}) {
    add(fmt::format("PCL {} {}", pcl_version(), method == PclMethod::icp ? "ICP" : "GICP"),
        [method, settings](auto model, auto data, const Pose& start) {
          const PclMatch match =
              pcl_match(method, model, data, start, static_cast<double>(settings.distance_limit_m),
                        settings.iterations, settings.translation_epsilon_m, settings.rotation_epsilon_rad);
          return Match{match.model_from_data, match.ms, 0};
        });
  }
#endif
  return all;
}

void measure(const Drive& drive, const Settings& settings) {
  print_heading("ICP of neighbouring scans");
  Ours ours;
  std::vector<Candidate> all = candidates(ours, settings);
  Samples points_a_scan;
  std::vector<Point> model_raw, data_raw;
  const offline::ConsistencySettings consistency;
  const std::size_t stride =
      std::max<std::size_t>(1, (drive.size - 1) / std::max<std::size_t>(1, settings.pairs));
  for (std::size_t i = 0; i + 1 < drive.size; i += stride) {
    print_progress(i, drive.size);
    drive.points(i, model_raw);
    drive.points(i + 1, data_raw);
    const std::vector<Point> model = reduced(model_raw, settings.cell_size_m);
    const std::vector<Point> data = reduced(data_raw, settings.cell_size_m);
    if (model.empty() || data.empty()) continue;
    points_a_scan.add(static_cast<double>(data.size()));
    const offline::SurfaceModel surface(model_raw, consistency);
    const Pose start = drive.odometry[i].inverse() * drive.odometry[i + 1];
    for (Candidate& candidate : all) {
      const Match match = candidate.match(model, data, start);
      candidate.ms.add(match.ms);
      candidate.iterations.add(match.iterations);
      const std::vector<double> residuals_m = surface.residuals_m(data_raw, match.model_from_data);
      if (residuals_m.size() >= consistency.min_correspondences)
        candidate.residual_cm.add(100 * offline::median(residuals_m));
      if (drive.truth.empty()) continue;
      const Pose truth = drive.truth[i].inverse() * drive.truth[i + 1];
      candidate.error_cm.add(100 * (truth.translation_m - match.model_from_data.translation_m).norm());
      candidate.error_deg.add(angle_between_rad(truth.rotation, match.model_from_data.rotation) * 180 /
                              std::numbers::pi);
    }
  }
  print_progress(1, 1);
  fmt::print(
      "{}; {} pairs, {:.0f} points a scan (median) in cells of {} m; distance limit {} m, at most {} "
      "iterations.\n\n",
      drive.name, points_a_scan.size(), points_a_scan.median(), settings.cell_size_m,
      settings.distance_limit_m, settings.iterations);
  print_header({"median (worst)", "time, ms", "times the default's", "iterations", "residual, cm",
                "error, cm", "error, deg"});
  const double default_ms = all[3].ms.median();
  for (const Candidate& candidate : all) {
    const auto both = [](const Samples& samples, const char* format) {
      return samples.size() == 0 ? std::string("-")
                                 : fmt::format(fmt::runtime(format), samples.median(), samples.worst());
    };
    print_row({candidate.name, both(candidate.ms, "{:.2f} ({:.2f})"),
               fmt::format("{:.2f}", candidate.ms.median() / default_ms),
               candidate.iterations.worst() > 0 ? both(candidate.iterations, "{:.0f} ({:.0f})") : "-",
               both(candidate.residual_cm, "{:.2f} ({:.2f})"), both(candidate.error_cm, "{:.2f} ({:.2f})"),
               both(candidate.error_deg, "{:.3f} ({:.3f})")});
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Our ICP beside PCL's ICP and GICP on neighbouring scans of a drive");
  DriveOptions options;
  Settings settings;
  options.add_to(app);
  app.add_option("--pairs", settings.pairs, "About so many, spread over the drive")->capture_default_str();
  app.add_option("--voxel", settings.cell_size_m, "Edge of a reduction cell, m")->capture_default_str();
  app.add_option("--max-distance", settings.distance_limit_m, "Of correspondences, m")->capture_default_str();
  app.add_option("--iterations", settings.iterations, "At most")->capture_default_str();
  return run(argc, argv, app, [&] { measure(options.open(), settings); });
}
