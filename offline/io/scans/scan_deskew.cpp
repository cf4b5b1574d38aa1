#include "scan_deskew.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "alces_platform/settings/memory_plan.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_poses = 4096;  ///< of the motion within a scan; of more, every second, third, ...

using Known = std::pair<std::string_view, DeskewMode>;
constexpr std::array<Known, 4> modes = {
    Known{"auto", DeskewMode::automatic}, Known{"odometry", DeskewMode::odometry},
    Known{"velocity", DeskewMode::velocity}, Known{"none", DeskewMode::none}};

/// A Deskew in memory of its own.
class DeskewInBlock {
 public:
  explicit DeskewInBlock(const DeskewConfig& config)
      : block_(required(config)), arena_(block_.bytes()), deskew_(arena_, config) {}
  Deskew* operator->() { return &deskew_; }
  Deskew& operator*() { return deskew_; }

 private:
  static std::size_t required(const DeskewConfig& config) {
    Arena counting;
    const Deskew planned(counting, config);
    return counting.used_bytes();
  }

  settings::MemoryBlock block_;
  Arena arena_;
  Deskew deskew_;
};

double shift_m(const Point& a, const Point& b) {
  const double m = static_cast<double>(std::hypot(a.x - b.x, a.y - b.y, a.z - b.z));
  return std::isfinite(m) ? m : 0;
}

std::string scans(std::size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "scan" : "scans");
}

}  // namespace

std::optional<DeskewMode> deskew_mode_called(std::string_view name) {
  for (const auto& [known, mode] : modes) {
    if (name == known) return mode;
  }
  return std::nullopt;
}

std::vector<std::string> deskew_mode_names() {
  std::vector<std::string> names;
  for (const auto& [name, mode] : modes) names.emplace_back(name);
  return names;
}

void ScanDeskew::deskew(const ScanSource& source, std::size_t index, ScanPoints& scan) {
  last_time_s_ = std::exchange(time_s_, source.stamp_s(index));
  if (!time_s_) time_s_ = scan.clock_s;
  if (scan.time_s.empty()) return;
  ++with_times_;
  if (mode_ == DeskewMode::none) return;
  const auto [first_s, last_s] = std::ranges::minmax(scan.time_s);
  longest_scan_s_ = std::max(longest_scan_s_, static_cast<double>(last_s) - static_cast<double>(first_s));
  std::string why;
  if (mode_ != DeskewMode::velocity) {
    why = deskew_by_odometry(source, index, scan);
    if (why.empty()) {
      ++by_odometry_;
      return;
    }
  }
  if (mode_ != DeskewMode::odometry) {
    const std::string why_not = deskew_by_velocity(scan);
    if (why_not.empty()) {
      ++by_velocity_;
      return;
    }
    why = why.empty() ? why_not : why + ", and " + why_not;
  }
  ++not_deskewed_[why];
}

bool ScanDeskew::needs_first_step(const ScanSource& source, const ScanPoints& first) const {
  if (first.time_s.empty() || mode_ == DeskewMode::none || mode_ == DeskewMode::odometry) return false;
  return mode_ == DeskewMode::velocity || !source.odometry(0) || source.motion(0, 0, 0).size() < 2;
}

void ScanDeskew::observe_first_step(const ScanSource& source, const ScanPoints& first,
                                    const ScanPoints& second, const Pose& last_from_next) {
  const std::optional<double> stamps_s[2] = {source.stamp_s(0), source.stamp_s(1)};
  last_time_s_ = stamps_s[0] ? stamps_s[0] : first.clock_s;
  time_s_ = stamps_s[1] ? stamps_s[1] : second.clock_s;
  observe_step(&last_from_next);
  last_time_s_.reset();
  time_s_.reset();
}

bool ScanDeskew::deskew_uncounted(ScanPoints& scan) const {
  if (!twist_per_s_ || scan.time_s.empty()) return false;
  DeskewInBlock deskew(DeskewConfig{.pose_capacity = 1});
  return deskew->set_twist(*twist_per_s_) == DeskewStatus::ok &&
         deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok;
}

std::string ScanDeskew::deskew_by_odometry(const ScanSource& source, std::size_t index, ScanPoints& scan) {
  const std::optional<double> stamp_s = source.stamp_s(index);
  if (!source.odometry(index)) return "there is no odometry";
  if (!stamp_s) return "no stamps are known for the odometry (--scan-interval gives them)";
  const auto [first_s, last_s] = std::ranges::minmax(scan.time_s);
  const double from_s = *stamp_s + std::min(0.0, static_cast<double>(first_s));
  const double to_s = *stamp_s + std::max(0.0, static_cast<double>(last_s));
  const std::vector<TimedPose> poses = source.motion(index, from_s, to_s);
  if (poses.size() < 2) return "the odometry has no two poses beside them";
  double widest_s = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    widest_s = std::max(widest_s, poses[i].time_s - poses[i - 1].time_s);
  const double usable_s = std::max(2.0, 3 * (to_s - from_s));
  if (widest_s > usable_s) return "the poses of the odometry are too far apart in time";

  const std::size_t every = poses.size() / most_poses + 1;
  const DeskewConfig config{.pose_capacity = most_poses, .longest_extrapolation_s = 1.5 * widest_s};
  DeskewInBlock deskew(config);
  for (std::size_t i = 0; i < poses.size(); i += every) {
    // From the stamp on, as the points: floats of seconds since 1970 would be minutes apart.
    const DeskewStatus added = deskew->add_pose(poses[i].time_s - *stamp_s, poses[i].odometry_from_body);
    if (added != DeskewStatus::ok) return fmt::format("the odometry: {}", alces::to_string(added));
  }
  return apply(*deskew, scan);
}

std::string ScanDeskew::deskew_by_velocity(ScanPoints& scan) {
  if (!time_s_) return "no stamps are known for a velocity (--scan-interval gives them)";
  if (!twist_per_s_) return "no step has told the velocity yet";
  DeskewInBlock deskew(DeskewConfig{.pose_capacity = 1});
  const DeskewStatus set = deskew->set_twist(*twist_per_s_);
  return set == DeskewStatus::ok ? apply(*deskew, scan) : alces::to_string(set);
}

std::string ScanDeskew::apply(const Deskew& deskew, ScanPoints& scan) {
  before_ = scan.points;
  const DeskewStatus status = deskew.apply(scan.points, scan.time_s, 0);
  if (status != DeskewStatus::ok) return alces::to_string(status);
  for (std::size_t i = 0; i < before_.size(); ++i)
    largest_shift_m_ = std::max(largest_shift_m_, shift_m(before_[i], scan.points[i]));
  return {};
}

void ScanDeskew::observe_step(const Pose* last_from_next) {
  if (last_from_next == nullptr || !time_s_ || !last_time_s_) return;
  const double step_s = *time_s_ - *last_time_s_;
  constexpr double longest_step_s = 2;  // after longer ones it may go on quite otherwise
  if (!(step_s > 0) || step_s > longest_step_s) {
    twist_per_s_.reset();
    return;
  }
  twist_per_s_ = log_se3(*last_from_next) / step_s;
}

std::string ScanDeskew::text() const {
  if (with_times_ == 0) return {};
  if (mode_ == DeskewMode::none)
    return fmt::format("{} have times and are taken as deskewed already", scans(with_times_));
  std::string line;
  const auto add = [&line](const std::string& clause) { line += (line.empty() ? "" : "; ") + clause; };
  if (by_odometry_ > 0) add(fmt::format("deskewed by odometry: {}", scans(by_odometry_)));
  if (by_velocity_ > 0) add(fmt::format("deskewed by the motion of the last steps: {}", scans(by_velocity_)));
  if (by_odometry_ + by_velocity_ > 0)
    add(fmt::format(
        "{:.3g} s a scan, points moved by up to {:.2g} m (--deskew none if they were deskewed already)",
        longest_scan_s_, largest_shift_m_));
  for (const auto& [why, count] : not_deskewed_) add(fmt::format("not deskewed: {}, {}", scans(count), why));
  return line;
}

nlohmann::json ScanDeskew::json() const {
  nlohmann::json reasons = nlohmann::json::object();
  for (const auto& [why, count] : not_deskewed_) reasons[why] = count;
  return {{"mode", std::string(modes.at(static_cast<std::size_t>(mode_)).first)},
          {"scans_with_times", with_times_},
          {"by_odometry", by_odometry_},
          {"by_velocity", by_velocity_},
          {"not_deskewed", reasons},
          {"longest_scan_s", longest_scan_s_},
          {"largest_shift_m", largest_shift_m_}};
}

}  // namespace alces::offline
