// The whole mapper on a drive, once with loops and once without: time a scan, time a loop, error against the
// truth.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces/mapper.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/map/mapper_settings.h"
#include "offline/map/memory_plan.h"
#include "offline/map/steady_stage_clock.h"
#include "support.h"

namespace {

using namespace alces;
using namespace alces::bench;

struct Settings {
  bool paper = false;
  std::string settings_file;
  std::size_t memory_mib = 64;
  std::string out;  ///< trajectory with loops
};

class Run {
 public:
  Run(MapperConfig config, std::size_t limit_bytes)
      : plan_(offline::plan_memory(config, limit_bytes)), block_(plan_.block_bytes) {
    Status status = Status::ok;
    mapper_ = Mapper::create(block_.bytes(), config, status, nullptr, &clock_);
    if (mapper_ == nullptr) throw std::runtime_error(to_string(status));
  }

  void add(std::span<const Point> points, const Pose& odometry) {
    ScanReport report;
    const Stopwatch watch;
    const Status status = mapper_->add_scan(points, &odometry, report);
    const double ms = watch.ms();
    if (status != Status::ok && status != Status::no_voxel_capacity)
      throw std::runtime_error(to_string(status));
    const StageTimes& t = report.times;
    total_ms.add(ms);
    reduce_ms.add(in_ms(t.reduce_ns));
    store_ms.add(in_ms(t.store_ns));
    match_ms.add(in_ms(t.match_ns));
    detect_ms.add(in_ms(t.detect_ns));
    front_end_ms.add(in_ms(t.reduce_ns + t.store_ns + t.match_ns));
    points_in.add(report.points.points);
    points_kept.add(report.points.kept);
    iterations.add(report.iterations);
    if (report.loop_offered) add_loop(report.loop, t);
  }
  void finish() {
    LoopReport loop;
    StageTimes times;
    if (mapper_->finish(loop, &times)) add_loop(loop, times);
  }

  [[nodiscard]] const Mapper& mapper() const { return *mapper_; }
  [[nodiscard]] const offline::MemoryPlan& plan() const { return plan_; }
  [[nodiscard]] Samples errors_m(std::span<const Pose> truth) const {
    Samples errors;
    for (std::size_t i = 0; i < truth.size(); ++i)
      errors.add((mapper_->graph().poses()[i].translation_m - truth[i].translation_m).norm());
    return errors;
  }

  Samples total_ms, front_end_ms, reduce_ms, store_ms, match_ms, detect_ms, points_in, points_kept,
      iterations;
  Samples loop_ms;    ///< offered, whatever came of it
  Samples closed_ms;  ///< closed
  Samples share_ms;

 private:
  void add_loop(const LoopReport& loop, const StageTimes& times) {
    loop_ms.add(in_ms(times.loop_match_ns + times.loop_share_ns));
    if (loop.verdict != LoopVerdict::closed) return;
    closed_ms.add(in_ms(times.loop_match_ns + times.loop_share_ns));
    share_ms.add(in_ms(times.loop_share_ns));
  }
  static double in_ms(std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; }

  offline::MemoryPlan plan_;
  offline::MemoryBlock block_;
  offline::SteadyStageClock clock_;
  Mapper* mapper_ = nullptr;
};

std::string medians(const Samples& samples) {
  return samples.size() == 0
             ? "-"
             : fmt::format("{:.3f} | {:.3f} | {:.3f}", samples.median(), samples.mean(), samples.worst());
}

void measure(const Drive& drive, const Settings& settings) {
  print_heading(settings.paper ? "The mapper, the paper's front end" : "The mapper");
  MapperConfig config =
      offline::default_settings(settings.paper ? offline::FrontEnd::paper : offline::FrontEnd::standard);
  if (!settings.settings_file.empty()) offline::read_settings(settings.settings_file, config);
  config.scan_capacity = static_cast<std::uint32_t>(drive.size);
  MapperConfig open = config;
  open.close_loops = false;
  Run with_loops(config, settings.memory_mib << 20);
  Run without_loops(open, settings.memory_mib << 20);
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size; ++i) {
    print_progress(i, drive.size);
    drive.points(i, points);
    with_loops.add(points, drive.odometry[i]);
    without_loops.add(points, drive.odometry[i]);
  }
  print_progress(1, 1);
  with_loops.finish();

  const Run& run = with_loops;
  const Mapper::Counters& counters = run.mapper().counters();
  fmt::print(
      "{}; {} scans of {:.0f} points, {:.0f} after reduction (medians); {:.0f} iterations a match "
      "(median).\n\n",
      drive.name, drive.size, run.points_in.median(), run.points_kept.median(), run.iterations.median());
  print_header({"time, ms", "median", "mean", "worst"});
  const auto row = [](const char* name, const Samples& samples) { print_row({name, medians(samples)}); };
  row("front end a scan", run.front_end_ms);
  row("- reduce", run.reduce_ms);
  row("- store (quantise, tree, surface)", run.store_ms);
  row("- match", run.match_ms);
  row("detect loops, a scan", run.detect_ms);
  row("closing one loop", run.closed_ms);
  row("- LOA and sharing out", run.share_ms);
  row("a loop offered, closed or refused", run.loop_ms);
  row("all of add_scan", run.total_ms);
  fmt::print("\n");
  print_header({"figure", "with loops", "without"});
  print_row(
      {"loops closed / offered", fmt::format("{} / {}", counters.loops_closed, counters.loops_offered), "-"});
  print_row({"scans placed by odometry alone", fmt::format("{}", counters.scans_predicted),
             fmt::format("{}", without_loops.mapper().counters().scans_predicted)});
  if (!drive.truth.empty()) {
    const Samples closed = with_loops.errors_m(drive.truth);
    const Samples opened = without_loops.errors_m(drive.truth);
    print_row({"translation error, mean, m", fmt::format("{:.3f}", closed.mean()),
               fmt::format("{:.3f}", opened.mean())});
    print_row({"translation error, worst, m", fmt::format("{:.3f}", closed.worst()),
               fmt::format("{:.3f}", opened.worst())});
  }
  const offline::MemoryPlan& plan = run.plan();
  print_row({"memory planned", offline::format_byte_size(plan.block_bytes),
             offline::format_byte_size(without_loops.plan().block_bytes)});
  print_row({"- its point pool in use, of",
             fmt::format("{} of {}", offline::format_byte_size(run.mapper().store_counters().pool_bytes),
                         offline::format_byte_size(plan.pool_bytes)),
             "-"});
  fmt::print("\n");
  if (!settings.out.empty()) {
    offline::Trajectory trajectory;
    for (const Pose& pose : run.mapper().graph().poses()) {
      trajectory.stamps_s.push_back(static_cast<double>(trajectory.poses.size()));
      trajectory.poses.push_back(pose);
    }
    offline::write_tum(settings.out, trajectory);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The whole mapper on a drive: time a scan, time a loop, error against the truth");
  DriveOptions options;
  Settings settings;
  options.add_to(app);
  app.add_flag("--paper", settings.paper, "The paper's front end instead of the default");
  app.add_option("--settings", settings.settings_file, "A TOML file as `alces map` takes it")
      ->check(CLI::ExistingFile);
  app.add_option("--memory", settings.memory_mib, "Of a mapper, MiB")->capture_default_str();
  app.add_option("--out", settings.out, "Write the poses with loops here (TUM)");
  return run(argc, argv, app, [&] { measure(options.open(), settings); });
}
