#include "bag_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "alces_drivers/stamp.h"
#include "alces_platform/bags/messages.h"
#include "alces_platform/bags/point_cloud.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_delays = 101;

std::string layout_text(const bags::PointCloud2& cloud) {
  std::string text;
  for (const bags::PointField& field : cloud.fields) {
    if (!text.empty()) text += ", ";
    text += fmt::format("{} {}", field.name, bags::type_name(field.type));
    if (field.count > 1) text += fmt::format("[{}]", field.count);
  }
  return text;
}

class Surveyor {
 public:
  explicit Surveyor(BagSurvey& survey) : survey_(survey) {}

  void take(const bags::BagReader& bag, const bags::Message& message) {
    add_channels(bag);
    SurveyedTopic& topic = survey_.topics[message.channel];
    if (topic.messages++ == 0) topic.first_log_ns = message.log_time_ns;
    topic.first_log_ns = std::min(topic.first_log_ns, message.log_time_ns);
    topic.last_log_ns = std::max(topic.last_log_ns, message.log_time_ns);
    topic.bytes += message.data.size();
    if (topic.channel.encoding == bags::Encoding::other) return;
    const bags::MessageCursor cursor(topic.channel.encoding, message.data);
    if (bags::is_transforms_type(topic.channel.type)) {
      take_transforms(topic, cursor, message.log_time_ns);
    } else if (bags::begins_with_header(topic.channel)) {
      take_stamped(topic, cursor, message);
    }
  }

  void add_channels(const bags::BagReader& bag) {
    for (std::size_t i = survey_.topics.size(); i < bag.channels().size(); ++i)
      survey_.topics.emplace_back().channel = bag.channels()[i];
  }

 private:
  static void note_damage(SurveyedTopic& topic, const std::string& what) {
    if (topic.damaged++ == 0) topic.first_problem = what;
  }

  void take_stamped(SurveyedTopic& topic, const bags::MessageCursor& cursor, const bags::Message& message) {
    const std::optional<bags::Header> header = bags::read_header(cursor);
    if (!header) return note_damage(topic, "is too short for its type");
    if (!topic.has_header) topic.frame = header->frame;
    topic.has_header = true;
    const std::int64_t stamp_ns = stamp_or(header->stamp_ns, message.log_time_ns);
    if (stamp_ns != header->stamp_ns) ++topic.without_stamp;
    if (topic.delays_ns.size() < most_delays) topic.delays_ns.push_back(message.log_time_ns - stamp_ns);
    if (bags::is_pose_type(topic.channel.type)) {
      take_pose(topic, cursor, stamp_ns);
    } else if (bags::is_cloud_type(topic.channel.type)) {
      take_scan(topic, message.data, stamp_ns);
    }
  }

  static void take_pose(SurveyedTopic& topic, const bags::MessageCursor& cursor, std::int64_t stamp_ns) {
    const std::optional<bags::StampedPose> pose = bags::read_pose(topic.channel.type, cursor);
    if (!pose) return note_damage(topic, "is too short for its type");
    if (topic.child.empty()) topic.child = pose->child;
    if (!topic.poses.add(stamp_ns, pose->pose))
      note_damage(topic, "holds a pose that is not finite or no rotation");
  }

  void take_scan(SurveyedTopic& topic, std::span<const std::uint8_t> data, std::int64_t stamp_ns) {
    const std::optional<bags::PointCloud2> cloud = bags::read_cloud(topic.channel, data, room_);
    if (!cloud) return note_damage(topic, "does not decode as its type");
    if (const std::string problem = bags::layout_problem(*cloud); !problem.empty())
      return note_damage(topic, problem);
    if (topic.layout.empty()) topic.layout = layout_text(*cloud);
    if (topic.points < 2) {
      topic.points = cloud->points();
      topic.first_channels = channels_of(*cloud);
      topic.first_stamp_ns = stamp_ns;
      bags::read_points(*cloud, topic.first_points);
      if (bags::is_profile_type(topic.channel.type)) topic.view_rad = view_rad(topic.channel, data);
    }
    if (!topic.scans.empty() && stamp_ns <= topic.scans.back().stamp_ns) {
      ++topic.late;
      return;
    }
    topic.scans.push_back({stamp_ns, topic.messages - 1, topic.messages - 1, data.size()});
  }

  static double view_rad(const bags::Channel& channel, std::span<const std::uint8_t> data) {
    const auto scan = bags::read_laser_scan(bags::MessageCursor(channel.encoding, data));
    if (!scan) return 0;
    return std::abs(static_cast<double>(scan->angle_increment_rad)) *
           static_cast<double>(scan->ranges_m.size());
  }

  void take_transforms(SurveyedTopic& topic, const bags::MessageCursor& cursor, std::int64_t log_ns) {
    const auto transforms = bags::read_transforms(cursor);
    if (!transforms) return note_damage(topic, "is too short for its type");
    const bool is_static = topic.channel.topic.ends_with("tf_static");
    for (const bags::StampedPose& each : *transforms) {
      const std::int64_t stamp_ns = stamp_or(each.header.stamp_ns, log_ns);
      if (!is_static && survey_.frame_delays_ns.size() < most_delays)
        survey_.frame_delays_ns.push_back(log_ns - stamp_ns);
      if (!survey_.frames.add(each.header.frame, each.child, stamp_ns, each.pose, is_static))
        note_damage(topic, fmt::format("puts {} into {} where it cannot be", each.child, each.header.frame));
    }
  }

  BagSurvey& survey_;
  std::vector<std::uint8_t> room_;
};

}  // namespace

double SurveyedTopic::rate_hz() const {
  if (messages < 2 || last_log_ns <= first_log_ns) return 0;
  return static_cast<double>(messages - 1) / (seconds(last_log_ns - first_log_ns));
}

ChannelContext SurveyedTopic::channel_context() const {
  ChannelContext context{.name = channel.topic};
  if (const double usual_s = interval_s(); usual_s > 0) context.scan_interval_s = usual_s;
  return context;
}

ChannelReading SurveyedTopic::channel_reading() const {
  ChannelReading reading;
  ScanPoints scan;
  scan.points = first_points;
  ChannelContext context = channel_context();
  context.stamp_s = stamp_in_s(first_stamp_ns);
  std::vector<std::string> unused;  // a first scan decides, it is not refused
  take_channels(first_channels, context, reading, scan, unused);
  return reading;
}

double SurveyedTopic::interval_s() const {
  std::vector<std::int64_t> steps_ns;
  for (std::size_t i = 1; i < scans.size(); ++i)
    steps_ns.push_back(scans[i].stamp_ns - scans[i - 1].stamp_ns);
  return seconds(median_ns(std::move(steps_ns)));
}

std::int64_t SurveyedTopic::delay_ns() const {
  return median_ns(delays_ns);
}

const SurveyedTopic* BagSurvey::topic(const std::string& name) const {
  const auto found = std::find_if(topics.begin(), topics.end(), [&](const SurveyedTopic& each) {
    return each.channel.topic == name || each.channel.topic == "/" + name;
  });
  return found == topics.end() ? nullptr : &*found;
}

std::uint64_t BagSurvey::messages() const {
  std::uint64_t messages = 0;
  for (const SurveyedTopic& topic : topics) messages += topic.messages;
  return messages;
}

std::int64_t stamp_or(std::int64_t stamp_ns, std::int64_t log_ns) {
  return stamp_ns > 0 && is_sane_stamp(stamp_ns) ? stamp_ns : log_ns;
}

std::int64_t median_ns(std::vector<std::int64_t> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

BagSurvey survey_bag(const std::filesystem::path& path,
                     const std::function<void(std::size_t, std::size_t)>& progress) {
  BagSurvey survey;
  survey.path = path;
  try {
    const std::unique_ptr<bags::BagReader> bag = bags::open_bag(path);
    survey.title = bag->title();
    survey.bytes = bag->total_bytes();
    Surveyor surveyor(survey);
    bags::Message message;
    while (bag->next(message)) {
      surveyor.take(*bag, message);
      if (progress)
        progress(static_cast<std::size_t>(std::min(bag->bytes_read(), survey.bytes)),
                 static_cast<std::size_t>(survey.bytes));
    }
    surveyor.add_channels(*bag);
    survey.problems = bag->problems();
    survey.problem_count = bag->problem_count();
  } catch (const bags::BagError& error) {
    throw InputError(error.what());
  }
  survey.frames.settle();
  for (SurveyedTopic& topic : survey.topics) topic.poses.settle();
  return survey;
}

}  // namespace alces::offline
