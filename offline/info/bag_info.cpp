#include "bag_info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "alces_drivers/stamp.h"
#include "alces_platform/bags/messages.h"
#include "alces_platform/bags/point_cloud.h"
#include "offline/io/bags/bag_choice.h"
#include "offline/io/bags/bag_survey.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

using Json = nlohmann::ordered_json;

std::string utc_text(std::int64_t utc_ns) {
  const std::chrono::sys_seconds time(
      std::chrono::floor<std::chrono::seconds>(std::chrono::nanoseconds(utc_ns)));
  return fmt::format("{:%Y-%m-%d %H:%M:%S}Z", time);
}

/// What a topic is used for; none: for nothing.
std::optional<std::string> use_of(const BagSurvey& survey, std::size_t place,
                                  const std::optional<BagChoice>& choice) {
  const SurveyedTopic& topic = survey.topics[place];
  const std::string& type = topic.channel.type;
  if (topic.messages == 0) return "no messages";
  if (topic.channel.encoding == bags::Encoding::other)
    return fmt::format("encoded as '{}', not read", topic.channel.encoding_name);
  if (choice) {
    if (place == choice->scans) return "scans";
    if (choice->odometry == BagOdometry::topic && place == choice->odometry_topic) return "odometry";
    if (bags::is_transforms_type(type)) {
      if (choice->odometry == BagOdometry::frames) return "frames, odometry";
      return "frames";
    }
  }
  if (bags::is_cloud_type(type)) return topic.scans.empty() ? topic.first_problem : "scans with --topic";
  if (bags::is_pose_type(type) && !topic.poses.is_empty()) return "odometry with --topic";
  return std::nullopt;
}

Json describe_topic(const BagSurvey& survey, std::size_t place, const std::optional<BagChoice>& choice) {
  const SurveyedTopic& topic = survey.topics[place];
  Json json;
  json["type"] = topic.channel.type;
  json["messages"] = topic.messages;
  json["bytes"] = topic.bytes;
  json["rate_hz"] = topic.rate_hz();
  if (topic.has_header) json["frame"] = topic.frame;
  if (!topic.child.empty()) json["child_frame"] = topic.child;
  if (!topic.layout.empty()) {
    json["points"] = topic.points;
    json["fields"] = topic.layout;
    const ChannelReading reading = topic.channel_reading();
    if (!reading.time_text.empty()) json["times"] = reading.time_text;
    if (!reading.intensity_text.empty()) json["intensities"] = reading.intensity_text;
  }
  if (topic.damaged > 0) json["damaged"] = topic.damaged;
  if (topic.late > 0) json["not_later_than_the_one_before"] = topic.late;
  if (topic.without_stamp > 0) json["without_stamp"] = topic.without_stamp;
  if (topic.has_header) json["recorded_after_stamp_s"] = seconds(topic.delay_ns());
  if (const auto use = use_of(survey, place, choice)) json["use"] = *use;
  return json;
}

Json describe_choice(const BagSurvey& survey, const BagChoice& choice) {
  Json json;
  json["scans"] = survey.topics[choice.scans].channel.topic;
  json["scans_frame"] = choice.scans_frame;
  json["body_frame"] = choice.body_frame;
  switch (choice.odometry) {
    case BagOdometry::none:
      json["odometry"] = nullptr;
      break;
    case BagOdometry::topic:
      json["odometry"] = survey.topics[choice.odometry_topic].channel.topic;
      break;
    case BagOdometry::frames:
      json["odometry"] = fmt::format("/tf, {} to {}", choice.odometry_frame, choice.odometry_child);
      break;
  }
  std::vector<std::string> notes = choice.notes;
  notes.insert(notes.end(), choice.warnings.begin(), choice.warnings.end());
  if (!notes.empty()) json["notes"] = notes;
  return json;
}

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.is_null() ? std::string("none") : value.dump();
}

}  // namespace

Json describe_bag(const std::filesystem::path& bag, const BagTopics& asked,
                  const std::function<void(std::size_t, std::size_t)>& progress) {
  const BagSurvey survey = survey_bag(bag, progress);
  std::optional<BagChoice> choice;
  std::string why_none;
  try {
    choice = choose_from_bag(survey, asked, true);
  } catch (const InputError& error) {
    why_none = error.what();
  }
  Json json;
  json["form"] = survey.title;
  json["is_whole"] = survey.problem_count == 0;
  if (!survey.problems.empty()) json["problems"] = survey.problems;
  json["bytes"] = survey.bytes;
  json["messages"] = survey.messages();
  std::int64_t begin_ns = INT64_MAX;
  std::int64_t end_ns = INT64_MIN;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.messages == 0) continue;
    begin_ns = std::min(begin_ns, topic.first_log_ns);
    end_ns = std::max(end_ns, topic.last_log_ns);
  }
  if (begin_ns <= end_ns) {
    json["duration_s"] = seconds(end_ns - begin_ns);
    json["begin_utc"] = utc_text(begin_ns);
  }
  Json topics = Json::object();
  for (std::size_t i = 0; i < survey.topics.size(); ++i)
    topics[survey.topics[i].channel.topic] = describe_topic(survey, i, choice);
  json["topics"] = topics;
  if (choice) json["map"] = describe_choice(survey, *choice);
  if (!choice) json["map"] = {{"not_possible", why_none}};
  return json;
}

std::string bag_text(const Json& description) {
  std::string text;
  const auto line = [&](const char* key, const std::string& value) {
    text += fmt::format("{}: {}\n", key, value);
  };
  line("path", text_of(description["path"]));
  line("kind", fmt::format("bag, {}", text_of(description["form"])));
  if (!description["is_whole"].get<bool>()) text += "problems:\n";
  for (const Json& problem : description.value("problems", Json::array()))
    text += fmt::format("  {}\n", text_of(problem));
  if (description.contains("duration_s"))
    line("recorded", fmt::format("{:.1f} s from {}, {} messages, {} bytes",
                                 description["duration_s"].get<double>(), text_of(description["begin_utc"]),
                                 text_of(description["messages"]), text_of(description["bytes"])));
  std::size_t topic_width = 5;
  std::size_t type_width = 4;
  std::size_t frame_width = 5;
  for (const auto& [name, topic] : description["topics"].items()) {
    topic_width = std::max(topic_width, name.size());
    type_width = std::max(type_width, text_of(topic["type"]).size());
    frame_width = std::max(frame_width, topic.value("frame", std::string()).size());
  }
  text += fmt::format("\n{:<{}}  {:<{}}  {:>9}  {:>8}  {:<{}}  use\n", "topic", topic_width, "type",
                      type_width, "messages", "Hz", "frame", frame_width);
  for (const auto& [name, topic] : description["topics"].items()) {
    text += fmt::format("{:<{}}  {:<{}}  {:>9}  {:>8.1f}  {:<{}}  {}\n", name, topic_width,
                        text_of(topic["type"]), type_width, topic["messages"].get<std::uint64_t>(),
                        topic["rate_hz"].get<double>(), topic.value("frame", std::string()), frame_width,
                        topic.value("use", std::string("-")));
    if (topic.contains("fields"))
      text += fmt::format("{:<{}}  {} points: {}{}\n", "", topic_width, text_of(topic["points"]),
                          text_of(topic["fields"]),
                          topic.contains("times") ? "; times " + text_of(topic["times"]) : std::string());
  }
  const Json& map = description["map"];
  text += "\n";
  if (map.contains("not_possible")) {
    line("no map can be made", text_of(map["not_possible"]));
    return text;
  }
  line("a map is made of",
       fmt::format("{} in {}, body {}, odometry {}", text_of(map["scans"]), text_of(map["scans_frame"]),
                   text_of(map["body_frame"]), text_of(map["odometry"])));
  for (const Json& note : map.value("notes", Json::array())) text += fmt::format("  {}\n", text_of(note));
  return text;
}

}  // namespace alces::offline
