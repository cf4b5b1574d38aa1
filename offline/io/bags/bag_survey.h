// One pass over a bag: its topics, the stamps of its scans, its poses and frames. What a map is made by is
// chosen from this (bag_choice.h); points are read in a second pass.
//
// Memory: 32 bytes a scan or profile and 72 a pose (PoseTrack), whatever the size of the bag.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "alces_platform/bags/bag_reader.h"
#include "cloud_channels.h"
#include "frame_tree.h"
#include "pose_track.h"

namespace alces::offline {

/// A message that is a scan, or the profiles of one.
struct SurveyedScan {
  std::int64_t stamp_ns = 0;       ///< of its (last) header; where that has none, when it was recorded
  std::uint64_t ordinal = 0;       ///< among the messages of its topic: the first
  std::uint64_t last_ordinal = 0;  ///< and the last
  std::uint64_t bytes = 0;         ///< of the messages
};

struct SurveyedTopic {
  bags::Channel channel;
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::int64_t first_log_ns = 0;
  std::int64_t last_log_ns = 0;
  std::string frame;                ///< of the first message's header
  std::string child;                ///< of the first pose
  std::string layout;               ///< of the first scan: "x y z float32, intensity float32, time float32"
  std::uint64_t points = 0;         ///< of the first scan
  double view_rad = 0;              ///< of a profile: from its first ray to its last
  RawChannels first_channels;       ///< of the first scan with points
  std::vector<Point> first_points;  ///< its points, where it has channels
  std::int64_t first_stamp_ns = 0;  ///< its stamp
  bool has_header = false;
  std::uint64_t without_stamp = 0;      ///< whose header's stamp is 0
  std::uint64_t damaged = 0;            ///< that do not decode as their type
  std::string first_problem;            ///< of those
  std::uint64_t late = 0;               ///< scans that are not after the one before: left out
  std::vector<std::int64_t> delays_ns;  ///< of the first messages: recorded - stamped
  std::vector<SurveyedScan> scans;
  PoseTrack poses;

  [[nodiscard]] double rate_hz() const;
  /// What the channels of its scans mean, by the first one. O(points).
  [[nodiscard]] ChannelReading channel_reading() const;
  /// What is known of any scan when its channels are read: not its stamp.
  [[nodiscard]] ChannelContext channel_context() const;
  /// From one scan to the next, in the median; 0 where there are none.
  [[nodiscard]] double interval_s() const;
  /// Recorded - stamped, in the median of the first messages; 0 where there are none.
  [[nodiscard]] std::int64_t delay_ns() const;
};

struct BagSurvey {
  std::filesystem::path path;
  std::string title;
  std::uint64_t bytes = 0;
  std::vector<SurveyedTopic> topics;
  FrameTree frames;
  std::vector<std::int64_t> frame_delays_ns;  ///< of moving frames: recorded - stamped
  std::vector<std::string> problems;
  std::uint64_t problem_count = 0;

  [[nodiscard]] const SurveyedTopic* topic(const std::string& name) const;
  [[nodiscard]] std::uint64_t messages() const;
};

/// InputError where it cannot be opened. `progress(done, total)` of its bytes may be empty.
[[nodiscard]] BagSurvey survey_bag(const std::filesystem::path& bag,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The stamp of a header; that of recording where there is none, or one that is no time.
[[nodiscard]] std::int64_t stamp_or(std::int64_t stamp_ns, std::int64_t log_ns);

/// Median; 0 of none.
[[nodiscard]] std::int64_t median_ns(std::vector<std::int64_t> values);

}  // namespace alces::offline
