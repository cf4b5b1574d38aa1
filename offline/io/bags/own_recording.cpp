#include "own_recording.h"

#include <algorithm>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/mcap_reader.h"

namespace alces::offline {

bool is_own_recording(const std::filesystem::path& file) {
  if (file.extension() != ".mcap") return false;
  FileSource source(file.c_str());
  mcap::Reader reader(source);
  if (!source.is_open() || !reader.open()) return false;
  return std::any_of(reader.schemas().begin(), reader.schemas().end(),
                     [](const auto& each) { return each.second.name.starts_with("alces_msgs/"); });
}

}  // namespace alces::offline
