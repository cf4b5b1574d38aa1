// Which of a bag's topics and frames make a map, and why: chosen by their types and by how the frames hang
// together, unless the user says it.
//
// Scans: of several topics the one with the most messages, of those the one with the most bytes; one whose
// frame is the odometry's own (a map, registered clouds), and 2D profiles, only where there is no other.
// Odometry: nav_msgs/ Odometry; without it /tf, from odom, or else from the root, to the body. Poses under
// the name of a truth, and of other types, are odometry only if asked for. The body's frame: that of the
// odometry's child.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bag_survey.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

enum class BagOdometry : std::uint8_t { none, topic, frames };

struct BagChoice {
  std::size_t scans = 0;  ///< of the survey's topics
  std::string scans_frame;
  std::string body_frame;  ///< empty: none is named, the points are taken as they are
  /// Whether the frames say where the scanner is on the body; false: it is taken for the body's own place.
  bool is_mounting_known = false;
  /// Points in the odometry's own frame: taken back into the body's by the odometry.
  bool are_scans_registered = false;

  BagOdometry odometry = BagOdometry::none;
  std::size_t odometry_topic = 0;      ///< of the survey's topics
  std::string odometry_frame;          ///< what the odometry is in
  std::string odometry_child;          ///< whose pose it is
  std::int64_t odometry_shift_ns = 0;  ///< added to its stamps: they are of another clock

  std::vector<std::string> notes;     ///< what was chosen among several, sentences
  std::vector<std::string> warnings;  ///< what should be seen
};

/// InputError, with the remedy, where there is nothing to choose, or nothing of that name.
/// `wants_odometry` false: it comes from elsewhere, or is not wanted.
[[nodiscard]] BagChoice choose_from_bag(const BagSurvey& survey, const BagTopics& asked, bool wants_odometry);

/// Topics of poses that a trajectory can be read from, for people: "/odom, /gt".
[[nodiscard]] std::string pose_topic_names(const BagSurvey& survey);

}  // namespace alces::offline
