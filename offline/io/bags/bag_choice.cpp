#include "bag_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "alces_drivers/stamp.h"
#include "alces_platform/bags/messages.h"
#include "alces_platform/bags/point_cloud.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

constexpr const char* odometry_type = "nav_msgs/Odometry";
/// Stamps that differ by more from the time of recording than those of the scans are of another clock.
constexpr std::int64_t other_clock_ns = 1'000'000'000;

bool is_called_truth(const std::string& topic) {
  std::string name;
  for (const char c : topic) name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  return name.find("truth") != std::string::npos || name.find("/gt") != std::string::npos ||
         name.find("_gt") != std::string::npos;
}

std::string names_of(const std::vector<const SurveyedTopic*>& topics) {
  constexpr std::size_t most = 8;
  std::string names;
  for (std::size_t i = 0; i < std::min(most, topics.size()); ++i)
    names += (i > 0 ? ", " : "") + topics[i]->channel.topic;
  if (topics.size() > most) names += fmt::format(" and {} more", topics.size() - most);
  return names;
}

class Chooser {
 public:
  Chooser(const BagSurvey& survey, const BagTopics& asked) : survey_(survey), asked_(asked) {}

  BagChoice choose(bool wants_odometry) {
    take_asked_topics();
    if (wants_odometry) choose_odometry();
    choose_scans();
    place_body();
    if (choice_.odometry != BagOdometry::none) compare_clocks();
    if (wants_odometry && choice_.odometry == BagOdometry::none) tell_of_no_odometry();
    return std::move(choice_);
  }

 private:
  [[nodiscard]] std::size_t place(const SurveyedTopic& topic) const {
    return static_cast<std::size_t>(&topic - survey_.topics.data());
  }
  void note(const std::string& sentence) { choice_.notes.push_back(sentence); }
  void warn(const std::string& sentence) { choice_.warnings.push_back(sentence); }

  void take_asked_topics() {
    for (const std::string& name : asked_.topics) {
      const SurveyedTopic* topic = survey_.topic(name);
      if (topic == nullptr) {
        std::vector<const SurveyedTopic*> all;
        for (const SurveyedTopic& each : survey_.topics) all.push_back(&each);
        throw InputError(survey_.path, fmt::format("has no topic {}; it has {}", name, names_of(all)));
      }
      const bool is_scan = bags::is_cloud_type(topic->channel.type);
      if (!is_scan && !bags::is_pose_type(topic->channel.type))
        throw InputError(survey_.path,
                         fmt::format("{} is of type {}, which is neither scans nor odometry that "
                                     "alces reads",
                                     topic->channel.topic, topic->channel.type));
      const SurveyedTopic*& chosen = is_scan ? asked_scans_ : asked_odometry_;
      if (chosen != nullptr)
        throw InputError(survey_.path,
                         fmt::format("{} and {} are both {}; name one of them", chosen->channel.topic,
                                     topic->channel.topic, is_scan ? "scans" : "odometry"));
      chosen = topic;
    }
  }

  void take_odometry(const SurveyedTopic& topic) {
    if (topic.poses.is_empty())
      throw InputError(survey_.path, fmt::format("{} has no pose that can be read", topic.channel.topic));
    choice_.odometry = BagOdometry::topic;
    choice_.odometry_topic = place(topic);
    choice_.odometry_frame = topic.frame;
    choice_.odometry_child = topic.child;
  }

  void choose_odometry() {
    if (asked_odometry_ != nullptr) return take_odometry(*asked_odometry_);
    if (!asked_.tf.empty()) return;  // place_body() looks for it
    std::vector<const SurveyedTopic*> found;
    std::vector<const SurveyedTopic*> others;
    for (const SurveyedTopic& topic : survey_.topics) {
      if (!bags::is_pose_type(topic.channel.type) || topic.poses.is_empty()) continue;
      const bool is_odometry = topic.channel.type == odometry_type && !is_called_truth(topic.channel.topic);
      (is_odometry ? found : others).push_back(&topic);
    }
    if (found.empty()) {
      if (!others.empty())
        note(fmt::format("poses of {} are not taken as odometry; --topic takes them", names_of(others)));
      return;
    }
    std::stable_sort(found.begin(), found.end(), [](const SurveyedTopic* a, const SurveyedTopic* b) {
      return a->messages != b->messages ? a->messages > b->messages : a->channel.topic < b->channel.topic;
    });
    take_odometry(*found.front());
    if (found.size() > 1) {
      const std::string chosen = found.front()->channel.topic;
      found.erase(found.begin());
      note(fmt::format("odometry is {}, of the most messages; not {}: --topic takes another", chosen,
                       names_of(found)));
    }
  }

  [[nodiscard]] bool is_registered(const SurveyedTopic& topic) const {
    return choice_.odometry == BagOdometry::topic && !topic.frame.empty() &&
           topic.frame == choice_.odometry_frame;
  }

  void choose_scans() {
    const SurveyedTopic* best = asked_scans_;
    std::vector<const SurveyedTopic*> others;
    if (best == nullptr) {
      for (const SurveyedTopic& topic : survey_.topics) {
        if (topic.scans.empty()) continue;
        if (best == nullptr || is_better(topic, *best)) {
          if (best != nullptr) others.push_back(best);
          best = &topic;
        } else {
          others.push_back(&topic);
        }
      }
    }
    if (best == nullptr) throw InputError(survey_.path, why_no_scans());
    if (best->scans.empty()) {
      const std::string why = best->channel.encoding == bags::Encoding::other
                                  ? "is encoded as '" + best->channel.encoding_name + "', which is not read"
                              : best->messages == 0
                                  ? "has no messages"
                                  : "has no message that can be read: it " + best->first_problem;
      throw InputError(survey_.path, fmt::format("{} {}", best->channel.topic, why));
    }
    choice_.scans = place(*best);
    choice_.scans_frame = best->frame;
    choice_.are_scans_registered = is_registered(*best);
    if (!others.empty())
      note(fmt::format("scans are {}; not {}: --topic takes another", best->channel.topic, names_of(others)));
  }

  [[nodiscard]] bool is_better(const SurveyedTopic& a, const SurveyedTopic& b) const {
    if (is_registered(a) != is_registered(b)) return is_registered(b);
    const bool a_is_flat = bags::is_profile_type(a.channel.type);
    if (a_is_flat != bags::is_profile_type(b.channel.type)) return !a_is_flat;
    // some messages are lost, of either: about as many are as many
    const auto [few, many] = std::minmax(a.scans.size(), b.scans.size());
    if (10 * few < 9 * many) return a.scans.size() > b.scans.size();
    return a.bytes != b.bytes ? a.bytes > b.bytes : a.channel.topic < b.channel.topic;
  }

  [[nodiscard]] std::string why_no_scans() const {
    std::vector<const SurveyedTopic*> all;
    std::string unread;
    for (const SurveyedTopic& topic : survey_.topics) {
      all.push_back(&topic);
      if (!bags::is_cloud_type(topic.channel.type)) continue;
      unread += fmt::format("; {} ", topic.channel.topic);
      if (topic.channel.encoding == bags::Encoding::other) {
        unread += fmt::format("is encoded as '{}', which is not read", topic.channel.encoding_name);
      } else {
        unread += topic.messages == 0 ? "has no messages" : topic.first_problem;
      }
    }
    if (all.empty()) return "holds no messages that can be read; was anything recorded?";
    if (!unread.empty()) return "holds no scans that can be read" + unread;
    std::string types;
    for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), 8); ++i)
      types += fmt::format("{}{} ({})", i > 0 ? ", " : "", all[i]->channel.topic, all[i]->channel.type);
    if (all.size() > 8) types += fmt::format(" and {} more", all.size() - 8);
    return fmt::format(
        "holds no scans (sensor_msgs/PointCloud2 or LaserScan, CustomMsg of Livox); its topics are {}",
        types);
  }

  void place_body() {
    const FrameTree& frames = survey_.frames;
    const std::string& scanner = choice_.scans_frame;
    if (choice_.odometry == BagOdometry::none && wants_frames()) choose_frames();
    if (!asked_.frame.empty()) {
      choice_.body_frame = asked_.frame;
    } else if (choice_.odometry == BagOdometry::topic && !choice_.odometry_child.empty()) {
      choice_.body_frame = choice_.odometry_child;
    } else if (choice_.body_frame.empty()) {
      const bool has_base = scanner != "base_link" && frames.are_connected(scanner, "base_link");
      choice_.body_frame = has_base ? "base_link" : scanner;
    }
    choice_.is_mounting_known = frames.are_connected(scanner, choice_.body_frame);
    if (choice_.are_scans_registered) {
      note(fmt::format(
          "the scans are in {}, the odometry's own frame: they are taken back into the body's by the "
          "odometry",
          scanner));
    } else if (!choice_.is_mounting_known) {
      if (!asked_.frame.empty())
        throw InputError(survey_.path, fmt::format("/tf and /tf_static do not lead from {} (of {}) to {}{}",
                                                   scanner, survey_.topics[choice_.scans].channel.topic,
                                                   choice_.body_frame, frame_names()));
      warn(fmt::format(
          "no /tf_static says where {} is on {}: the points are taken as if both were one; a wrong "
          "mounting bends the map",
          scanner.empty() ? "the scanner" : scanner, choice_.body_frame));
    }
    if (choice_.odometry == BagOdometry::topic && choice_.odometry_child.empty())
      choice_.odometry_child = choice_.body_frame;
    if (choice_.odometry == BagOdometry::topic && choice_.odometry_child != choice_.body_frame &&
        !frames.are_connected(choice_.odometry_child, choice_.body_frame))
      throw InputError(survey_.path,
                       fmt::format("/tf and /tf_static do not lead from {} (of the odometry) to {}{}",
                                   choice_.odometry_child, choice_.body_frame, frame_names()));
  }

  [[nodiscard]] bool wants_frames() const { return asked_odometry_ == nullptr; }

  /// /tf as odometry: from odom, or from the root, down to the scanner.
  void choose_frames() {
    const FrameTree& frames = survey_.frames;
    const std::string& scanner = choice_.scans_frame;
    const std::vector<std::string> way = frames.way_up(scanner);
    const auto find = [&](const std::string& frame) { return std::find(way.begin(), way.end(), frame); };
    auto fixed = way.end();
    if (!asked_.tf.empty()) {
      fixed = find(asked_.tf);
      if (fixed == way.end() || fixed == way.begin())
        throw InputError(survey_.path,
                         fmt::format("/tf does not lead from {} (of {}) up to {}{}", scanner,
                                     survey_.topics[choice_.scans].channel.topic, asked_.tf, frame_names()));
    } else if (find("odom") != way.end()) {
      fixed = find("odom");
    } else {
      fixed = way.end() - 1;
    }
    // the frame that moves in it, from above
    auto body = fixed;
    while (body != way.begin() && !frames.moves(*(body - 1))) --body;
    if (body == way.begin()) return;  // nothing moves
    const auto base = find("base_link");
    if (!asked_.frame.empty() && find(asked_.frame) < fixed) {
      body = find(asked_.frame);
    } else {
      body = base < body ? base : body - 1;
    }
    // what turns on the body alone is no odometry
    if (asked_.tf.empty() && *fixed == "base_link") return;
    choice_.odometry = BagOdometry::frames;
    choice_.odometry_frame = *fixed;
    choice_.odometry_child = *body;
    choice_.body_frame = *body;
  }

  [[nodiscard]] std::string frame_names() const {
    std::string names;
    for (const auto& [child, edge] : survey_.frames.edges()) {
      if (names.size() > 200) return names + ", ...";
      names += fmt::format("{}{} in {}", names.empty() ? "; there are " : ", ", child, edge.parent);
    }
    return names.empty() ? "; the bag has no frames" : names;
  }

  void compare_clocks() {
    const SurveyedTopic& scans = survey_.topics[choice_.scans];
    const bool is_topic = choice_.odometry == BagOdometry::topic;
    const std::int64_t odometry_delay_ns =
        is_topic ? survey_.topics[choice_.odometry_topic].delay_ns() : median_ns(survey_.frame_delays_ns);
    const std::int64_t apart_ns = odometry_delay_ns - scans.delay_ns();
    if (std::abs(apart_ns) <= other_clock_ns) return;
    choice_.odometry_shift_ns = apart_ns;
    warn(fmt::format(
        "the clocks of {} and {} disagree: beside the times of recording their stamps are {:.3f} s "
        "apart, which is taken off the odometry's",
        scans.channel.topic,
        is_topic ? survey_.topics[choice_.odometry_topic].channel.topic : std::string("/tf"),
        seconds(apart_ns)));
  }

  void tell_of_no_odometry() {
    warn(
        "no odometry: there is no nav_msgs/Odometry, and /tf does not say how the scanner moves; give poses "
        "with "
        "--odometry FILE, or name a topic of poses with --topic");
  }

  const BagSurvey& survey_;
  const BagTopics& asked_;
  const SurveyedTopic* asked_scans_ = nullptr;
  const SurveyedTopic* asked_odometry_ = nullptr;
  BagChoice choice_;
};

}  // namespace

BagChoice choose_from_bag(const BagSurvey& survey, const BagTopics& asked, bool wants_odometry) {
  return Chooser(survey, asked).choose(wants_odometry);
}

std::string pose_topic_names(const BagSurvey& survey) {
  std::vector<const SurveyedTopic*> found;
  for (const SurveyedTopic& topic : survey.topics) {
    if (!topic.poses.is_empty()) found.push_back(&topic);
  }
  return names_of(found);
}

}  // namespace alces::offline
