#include "bag_trajectory.h"

#include <fmt/format.h>

#include <string>
#include <system_error>

#include "alces_platform/bags/bag_reader.h"
#include "alces_platform/bags/messages.h"
#include "bag_choice.h"
#include "bag_survey.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

struct BagAndTopic {
  fs::path bag;
  std::string topic;  ///< empty: the only one
};

std::optional<BagAndTopic> bag_in(const fs::path& path) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) {
    if (!bags::is_bag(path)) return std::nullopt;
    return BagAndTopic{path, {}};
  }
  const std::string text = path.string();
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  const fs::path bag = text.substr(0, colon);
  if (!fs::exists(bag, ignored) || !bags::is_bag(bag)) return std::nullopt;
  return BagAndTopic{bag, text.substr(colon + 1)};
}

const SurveyedTopic& topic_of(const BagSurvey& survey, const std::string& name) {
  if (!name.empty()) {
    const SurveyedTopic* topic = survey.topic(name);
    if (topic == nullptr || topic->poses.is_empty())
      throw InputError(survey.path,
                       fmt::format("has no poses on {}; it has them on: {}", name, pose_topic_names(survey)));
    return *topic;
  }
  const SurveyedTopic* only = nullptr;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.poses.is_empty()) continue;
    if (only != nullptr)
      throw InputError(survey.path,
                       fmt::format("holds several trajectories ({}): name one, as {}:{}",
                                   pose_topic_names(survey), survey.path.string(), only->channel.topic));
    only = &topic;
  }
  if (only == nullptr)
    throw InputError(survey.path,
                     "holds no trajectory: no nav_msgs/Odometry and no geometry_msgs/PoseStamped");
  return *only;
}

}  // namespace

bool names_bag_topic(const fs::path& path) {
  const std::optional<BagAndTopic> named = bag_in(path);
  return named && !named->topic.empty();
}

std::optional<Trajectory> read_bag_trajectory(const fs::path& path) {
  const std::optional<BagAndTopic> wanted = bag_in(path);
  if (!wanted) return std::nullopt;
  const BagSurvey survey = survey_bag(wanted->bag);
  const SurveyedTopic& topic = topic_of(survey, wanted->topic);
  Trajectory trajectory;
  trajectory.has_time = true;
  trajectory.has_stamps = true;
  for (const PoseTrack::Sample& sample : topic.poses.samples()) {
    trajectory.stamps_s.push_back(stamp_in_s(sample.stamp_ns));
    trajectory.poses.push_back(sample.pose);
  }
  trajectory.notes = survey.problems;
  if (topic.damaged > 0)
    trajectory.notes.push_back(fmt::format("{}: {} of {} messages are left out: the first of them {}",
                                           topic.channel.topic, topic.damaged, topic.messages,
                                           topic.first_problem));
  if (topic.poses.is_thinned())
    trajectory.notes.push_back(fmt::format("{}: of more than {} poses only some are kept",
                                           topic.channel.topic, PoseTrack::most_poses));
  return trajectory;
}

}  // namespace alces::offline
