// The readers behind open_bag(), one a form.
#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "alces_platform/bags/bag_reader.h"
#include "alces_platform/recording/byte_source.h"

namespace alces::bags {

using Topics = std::set<std::string>;

[[nodiscard]] std::unique_ptr<BagReader> open_mcap_bag(const std::filesystem::path& file,
                                                       const Topics& topics);
[[nodiscard]] std::unique_ptr<BagReader> open_sqlite_bag(const std::filesystem::path& file,
                                                         const Topics& topics);
[[nodiscard]] std::unique_ptr<BagReader> open_ros1_bag(const std::filesystem::path& file,
                                                       const Topics& topics);
[[nodiscard]] std::unique_ptr<BagReader> open_rosbag2_folder(const std::filesystem::path& folder,
                                                             const Topics& topics);

/// "sensor_msgs/PointCloud2" of "sensor_msgs/msg/PointCloud2".
[[nodiscard]] std::string plain_type(std::string_view type);
[[nodiscard]] Encoding encoding_called(std::string_view name);
[[nodiscard]] bool is_asked_for(const Topics& topics, const std::string& topic);
/// 0 where it cannot be told.
[[nodiscard]] std::uint64_t size_of(const std::filesystem::path& file);

/// Later than latest_stamp_ns is no time: it stands for the end of all.
[[nodiscard]] std::int64_t sane_ns(std::uint64_t stamp_ns);

}  // namespace alces::bags
