// Times and intensities of a cloud's points, whatever their driver calls them and in whatever unit: found by
// name, type and the range of the first cloud's values, the same for all clouds of a topic.
//
//   time       a field t, time, timestamp, time_stamp, time_offset, offset_time or t_offset: the unit (s, ms,
//   us,
//              ns) is the one in which a cloud lasts as long as the clouds are apart. Since 1970, or since
//              the cloud's stamp.
//   intensity  a field intensity, reflectivity, signal or reflectance: uint8 as it is; up to 1 times 255; up
//   to
//              255 as it is; larger ones so that 99 % of the first cloud's points have up to 255.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "alces_platform/bags/point_cloud.h"
#include "offline/io/scans/scan_points.h"

namespace alces::offline {

/// Of one cloud.
struct CloudChannelFacts {
  std::string time_field;  ///< empty: there is none
  std::uint8_t time_type = 0;
  double first_time = 0;  ///< smallest and largest, as they are
  double last_time = 0;
  bool has_bad_times = false;  ///< some are not finite
  double stamp_s = 0;
  std::string intensity_field;  ///< empty: there is none
  std::uint8_t intensity_type = 0;
  double usual_intensity = 0;  ///< 99 % of the points have no more
};

/// The cloud has no layout_problem().
[[nodiscard]] CloudChannelFacts look_at_channels(const bags::PointCloud2& cloud, std::int64_t stamp_ns);

struct CloudTimeReading {
  std::string field;
  double unit_s = 1;
  bool is_since_1970 = false;
  std::string title;  ///< "float64 seconds since 1970"
};

struct CloudChannelReading {
  std::optional<CloudTimeReading> time;
  std::string time_problem;     ///< why there is none, though there is a field: a clause
  std::string intensity_field;  ///< empty: none
  double intensity_scale = 1;
};

/// `interval_s`: from one cloud to the next; 0: not known.
[[nodiscard]] CloudChannelReading choose_channels(const CloudChannelFacts& facts, double interval_s);

/// Fills the channels of `scan`, whose points are the cloud's. False: its times are not used: some are not
/// finite, or farther than 10 s from the stamp.
[[nodiscard]] bool read_channels(const bags::PointCloud2& cloud, const CloudChannelReading& reading,
                                 std::int64_t stamp_ns, ScanPoints& scan);

}  // namespace alces::offline
