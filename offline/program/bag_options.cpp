#include "bag_options.h"

#include <string>
#include <vector>

namespace alces::offline {

void add_bag_options(CLI::App& verb, BagTopics& bag) {
  verb.add_option("--topic", bag.topics,
                  "of a bag: the topic of the scans, that of the odometry, or both (given twice)")
      ->allow_extra_args(false);
  verb.add_option("--frame", bag.frame, "of a bag: the body's frame, as base_link");
  verb.add_option("--tf", bag.tf, "of a bag: odometry from /tf, from this frame (odom, map) to the body's");
}

nlohmann::json to_json(const BagTopics& bag) {
  return {{"topics", bag.topics}, {"frame", bag.frame}, {"tf", bag.tf}};
}

BagTopics bag_topics_from(const nlohmann::json& reading) {
  BagTopics bag;
  const auto found = reading.find("bag");
  if (found == reading.end() || !found->is_object()) return bag;
  bag.topics = found->value("topics", std::vector<std::string>());
  bag.frame = found->value("frame", std::string());
  bag.tf = found->value("tf", std::string());
  return bag;
}

}  // namespace alces::offline
