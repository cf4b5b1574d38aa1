// Times and intensities of a bag's cloud: point_channels.h says what they mean, as for files.
#pragma once

#include "alces_platform/bags/point_cloud.h"
#include "offline/io/scans/point_channels.h"

namespace alces::offline {

/// The fields of the cloud that are channels. The cloud has no layout_problem().
[[nodiscard]] RawChannels channels_of(const bags::PointCloud2& cloud);

}  // namespace alces::offline
