#include "own_recording.h"

#include <algorithm>
#include <system_error>

#include "alces_platform/bags/bag_reader.h"
#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/mcap_reader.h"

namespace alces::offline {
namespace {

enum class Contents { none, own, others };

Contents contents_of_mcap(const std::filesystem::path& file) {
  FileSource source(file.c_str());
  mcap::Reader reader(source);
  if (!source.is_open() || !reader.open()) return Contents::none;
  mcap::ReadMessage first;  // with it come the schemas of a file that keeps them in its chunks
  if (reader.schemas().empty() && !reader.next(first)) return Contents::none;
  const bool is_own = std::any_of(reader.schemas().begin(), reader.schemas().end(), [](const auto& each) {
    return each.second.name.starts_with("alces_msgs/");
  });
  return is_own ? Contents::own : Contents::others;
}

}  // namespace

bool is_own_recording(const std::filesystem::path& file) {
  return file.extension() == ".mcap" && contents_of_mcap(file) == Contents::own;
}

bool is_ros_bag(const std::filesystem::path& file_or_folder) {
  std::error_code ignored;
  if (!bags::is_bag(file_or_folder) || !std::filesystem::exists(file_or_folder, ignored)) return false;
  if (std::filesystem::is_directory(file_or_folder, ignored) || file_or_folder.extension() != ".mcap")
    return true;
  return contents_of_mcap(file_or_folder) == Contents::others;
}

}  // namespace alces::offline
