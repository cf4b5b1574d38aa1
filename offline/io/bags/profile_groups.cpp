#include "profile_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180;

class Grouping {
 public:
  explicit Grouping(double scan_rad) : scan_rad_(scan_rad) {}

  void add(const SurveyedScan& profile, const Eigen::Quaterniond& body_from_laser) {
    if (has_last_) {
      const Eigen::Vector3d step = log_so3(last_.conjugate() * body_from_laser);
      turned_in_all_rad_ += step.norm();
      constexpr double still_rad = 0.01 * rad_per_deg;
      constexpr double least_rad = 20 * rad_per_deg;  // a head that swings a little is no scan
      const bool turns_back = axis_.dot(step) < -still_rad && turned_rad_ > least_rad;
      if (turned_rad_ >= scan_rad_ || turns_back) close();
      if (step.norm() > still_rad) axis_ = step.normalized();
      turned_rad_ += step.norm();
    }
    last_ = body_from_laser;
    has_last_ = true;
    if (!is_open_) current_ = {profile.stamp_ns, profile.ordinal, profile.ordinal, 0};
    is_open_ = true;
    current_.stamp_ns = profile.stamp_ns;
    current_.last_ordinal = profile.ordinal;
    current_.bytes += profile.bytes;
  }

  /// What is open at the end counts as a scan when it saw half of one.
  bool finish() {
    if (turned_rad_ < scan_rad_ / 2) return !is_open_;
    close();
    return true;
  }

  [[nodiscard]] double turned_in_all_rad() const { return turned_in_all_rad_; }
  [[nodiscard]] std::vector<SurveyedScan>& scans() { return scans_; }

 private:
  void close() {
    scans_.push_back(current_);
    is_open_ = false;
    turned_rad_ = 0;
  }

  double scan_rad_;
  Eigen::Quaterniond last_ = Eigen::Quaterniond::Identity();
  bool has_last_ = false;
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();
  double turned_rad_ = 0;  ///< since the first profile of the current scan
  double turned_in_all_rad_ = 0;
  SurveyedScan current_;
  bool is_open_ = false;
  std::vector<SurveyedScan> scans_;
};

}  // namespace

std::vector<std::string> group_profiles(BagSurvey& survey, const BagChoice& choice) {
  SurveyedTopic& topic = survey.topics[choice.scans];
  const std::string& name = topic.channel.topic;
  constexpr double nearly_half_turn_rad = 170 * rad_per_deg;
  Grouping grouping(topic.view_rad >= nearly_half_turn_rad ? std::numbers::pi : 2 * std::numbers::pi);
  std::size_t without_place = 0;
  for (const SurveyedScan& profile : topic.scans) {
    const auto body_from_laser =
        survey.frames.between(choice.body_frame, choice.scans_frame, profile.stamp_ns);
    if (body_from_laser) {
      grouping.add(profile, body_from_laser->rotation);
    } else {
      ++without_place;
    }
  }
  constexpr double least_turn_rad = 20 * rad_per_deg;
  if (grouping.turned_in_all_rad() < least_turn_rad)
    throw InputError(
        survey.path,
        fmt::format("{} is a 2D laser ({}), and /tf does not turn it against {}: a profile alone is no "
                    "3D scan; name the body's frame with --frame, or a topic of clouds with --topic",
                    name, topic.channel.type, choice.body_frame));
  const std::size_t profiles = topic.scans.size() - without_place;
  std::vector<std::string> told;
  const bool is_all = grouping.finish();
  topic.scans = std::move(grouping.scans());
  if (topic.scans.empty())
    throw InputError(survey.path, fmt::format("the head of {} turns less than it needs for one scan", name));
  told.push_back(fmt::format("{}: {} profiles of a 2D laser on a turning head are assembled to {} scans",
                             name, profiles, topic.scans.size()));
  if (without_place > 0)
    told.push_back(
        fmt::format("{}: {} profiles are left out: at their stamps /tf does not lead from {} to {}", name,
                    without_place, choice.scans_frame, choice.body_frame));
  if (!is_all)
    told.push_back(fmt::format("{}: the last profiles, less than half a scan, are left out", name));
  return told;
}

}  // namespace alces::offline
