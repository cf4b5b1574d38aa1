#include "rosbag2_metadata.h"

#ifdef ALCES_HAS_YAML
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>

#include "bag_files.h"

namespace alces::bags {
namespace {

constexpr const char* without_it = "; the folder's files are taken in the order of their names";

/// Empty where it is not there.
std::string text_of(const YAML::Node& node) {
  return node && node.IsScalar() ? node.Scalar() : std::string();
}

}  // namespace

bool read_rosbag2_metadata(const std::filesystem::path& file, Rosbag2Metadata& metadata, std::string& what) {
  constexpr std::uint64_t largest_bytes = std::uint64_t{64} << 20;
  if (size_of(file) > largest_bytes) {  // it names topics and files
    what = std::string("is too large to be what ROS 2 writes") + without_it;
    return false;
  }
  std::vector<std::uint8_t> content(static_cast<std::size_t>(size_of(file)));
  FileSource source(file.c_str());
  const std::string bytes(reinterpret_cast<const char*>(content.data()), source.read(content));
  try {
    const YAML::Node all = YAML::Load(bytes);
    const YAML::Node bag = all.IsMap() ? all["rosbag2_bagfile_information"] : YAML::Node();
    if (!bag || !bag.IsMap()) {
      what = std::string("has no rosbag2_bagfile_information") + without_it;
      return false;
    }
    if (const YAML::Node files = bag["relative_file_paths"]; files && files.IsSequence()) {
      for (const YAML::Node& each : files) metadata.files.push_back(text_of(each));
    }
    metadata.compression_format = text_of(bag["compression_format"]);
    metadata.compression_mode = text_of(bag["compression_mode"]);
    for (char& c : metadata.compression_mode)
      c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));  // "FILE" of older recorders
  } catch (const YAML::Exception& error) {
    metadata = {};
    what = std::string("is no YAML that can be read (") + error.what() + ")" + without_it;
    return false;
  }
  return true;
}

}  // namespace alces::bags

#else

namespace alces::bags {

bool read_rosbag2_metadata(const std::filesystem::path& /*file*/, Rosbag2Metadata& /*metadata*/,
                           std::string& what) {
  what =
      "is not read, this alces was built without yaml-cpp; the folder's files are taken in the order of "
      "their "
      "names";
  return false;
}

}  // namespace alces::bags

#endif
