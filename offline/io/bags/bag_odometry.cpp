#include "bag_odometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {
namespace {

std::string digest_of(const std::vector<std::optional<Pose>>& poses) {
  ContentDigest digest;
  for (const std::optional<Pose>& pose : poses) {
    if (!pose) continue;
    digest.add({reinterpret_cast<const char*>(pose->translation_m.data()), 3 * sizeof(double)});
    digest.add({reinterpret_cast<const char*>(pose->rotation.coeffs().data()), 4 * sizeof(double)});
  }
  return digest.text();
}

void tell_of_missing(const BagSurvey& survey, const BagChoice& choice, ChosenOdometry& chosen) {
  const SurveyedTopic& topic = survey.topics[choice.scans];
  const auto without =
      static_cast<std::size_t>(std::count(chosen.poses.begin(), chosen.poses.end(), std::nullopt));
  if (without == 0) return;
  const auto first = std::find(chosen.poses.begin(), chosen.poses.end(), std::nullopt) - chosen.poses.begin();
  chosen.warnings.push_back(fmt::format(
      "{} of {} scans have no pose beside them in time ({}), of which {} {} is the first: no odometry for "
      "them",
      without, chosen.poses.size(), chosen.title, topic.channel.topic,
      topic.scans[static_cast<std::size_t>(first)].ordinal));
  if (without == chosen.poses.size()) {
    chosen.poses.clear();
    chosen.title = "no odometry";
  }
}

/// By stamps, as a bag's own; without them by order.
ChosenOdometry from_trajectory(const BagSurvey& survey, const BagChoice& choice,
                               const std::filesystem::path& file) {
  const SurveyedTopic& topic = survey.topics[choice.scans];
  const Trajectory trajectory = read_trajectory(file);
  ChosenOdometry chosen;
  chosen.warnings = trajectory.notes;
  chosen.title =
      fmt::format("odometry from {} by {}", file.string(), trajectory.has_time ? "stamp" : "order");
  if (!trajectory.has_time) {
    if (trajectory.size() != topic.scans.size())
      throw InputError(
          file, fmt::format("{} poses without times for {} scans of {}; give one pose a scan, or stamps",
                            trajectory.size(), topic.scans.size(), topic.channel.topic));
    chosen.poses.assign(trajectory.poses.begin(), trajectory.poses.end());
  } else {
    PoseTrack track;
    for (std::size_t i = 0; i < trajectory.size(); ++i)
      track.add(std::llround(1e9 * trajectory.stamps_s[i]), trajectory.poses[i]);
    track.settle();
    for (const SurveyedScan& scan : topic.scans) chosen.poses.push_back(track.at(scan.stamp_ns));
    tell_of_missing(survey, choice, chosen);
    if (chosen.poses.empty())
      throw InputError(
          file, fmt::format("none of its {} poses is of the time of a scan of {}; are their clocks the "
                            "same?",
                            trajectory.size(), topic.channel.topic));
  }
  chosen.origin = OdometryOrigin{file, digest_of(chosen.poses), trajectory.has_time ? "stamp" : "order"};
  return chosen;
}

ChosenOdometry from_bag(BagSurvey& survey, const BagChoice& choice) {
  ChosenOdometry chosen;
  std::string topic = "/tf";
  if (choice.odometry == BagOdometry::topic) {
    SurveyedTopic& poses = survey.topics[choice.odometry_topic];
    topic = poses.channel.topic;
    poses.poses.shift(choice.odometry_shift_ns);
    chosen.title = fmt::format("odometry from {}", topic);
    if (poses.damaged > 0)
      chosen.warnings.push_back(fmt::format("{}: {} of {} messages are left out: the first of them {}", topic,
                                            poses.damaged, poses.messages, poses.first_problem));
    if (poses.poses.is_thinned())
      chosen.warnings.push_back(
          fmt::format("{}: of more than {} poses only some are kept", topic, PoseTrack::most_poses));
  } else {
    survey.frames.shift(choice.odometry_shift_ns);
    chosen.title = fmt::format("odometry from /tf ({} to {})", choice.odometry_frame, choice.body_frame);
  }
  for (const SurveyedScan& scan : survey.topics[choice.scans].scans)
    chosen.poses.push_back(odometry_at(survey, choice, scan.stamp_ns));
  tell_of_missing(survey, choice, chosen);
  if (!chosen.poses.empty())
    chosen.origin = OdometryOrigin{survey.path.string() + ":" + topic, digest_of(chosen.poses), "stamp"};
  return chosen;
}

}  // namespace

std::optional<Pose> odometry_at(const BagSurvey& survey, const BagChoice& choice, std::int64_t stamp_ns) {
  if (choice.odometry == BagOdometry::none) return std::nullopt;
  if (choice.odometry == BagOdometry::frames)
    return survey.frames.between(choice.odometry_frame, choice.body_frame, stamp_ns);
  const std::optional<Pose> odometry_from_child = survey.topics[choice.odometry_topic].poses.at(stamp_ns);
  if (!odometry_from_child || choice.odometry_child == choice.body_frame) return odometry_from_child;
  const std::optional<Pose> child_from_body =
      survey.frames.between(choice.odometry_child, choice.body_frame, stamp_ns);
  if (!child_from_body) return std::nullopt;
  return *odometry_from_child * *child_from_body;
}

ChosenOdometry take_odometry(BagSurvey& survey, const BagChoice& choice, const ScanSourceOptions& options) {
  if (options.no_odometry) return {{}, "no odometry, as asked for", {}, {}};
  if (options.odometry) return from_trajectory(survey, choice, *options.odometry);
  if (choice.odometry == BagOdometry::none) return {{}, "no odometry", {}, {}};
  return from_bag(survey, choice);
}

}  // namespace alces::offline
