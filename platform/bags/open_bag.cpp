#include <algorithm>
#include <system_error>

#include "alces_drivers/stamp.h"
#include "bag_files.h"
#include "zstd_source.h"

namespace alces::bags {
namespace {

namespace fs = std::filesystem;

/// Of what is inside, where the file itself is packed: ".mcap" of "a.mcap.zstd".
fs::path inner_extension(const fs::path& file) {
  const fs::path extension = file.extension();
  return extension == ".zstd" || extension == ".zst" ? file.stem().extension() : extension;
}

}  // namespace

void BagReader::problem(const fs::path& file, const std::string& what) {
  ++problem_count_;
  if (problems_.size() < most_problems) problems_.push_back(file.string() + ": " + what);
}

std::string plain_type(std::string_view type) {
  std::string plain(type);
  if (const std::size_t at = plain.find("/msg/"); at != std::string::npos) plain.erase(at, 4);
  return plain;
}

Encoding encoding_called(std::string_view name) {
  if (name == "cdr") return Encoding::cdr;
  return name == "ros1" ? Encoding::ros1 : Encoding::other;
}

bool is_asked_for(const Topics& topics, const std::string& topic) {
  return topics.empty() || topics.contains(topic);
}

std::uint64_t size_of(const fs::path& file) {
  std::error_code failed;
  const std::uintmax_t bytes = fs::file_size(file, failed);
  return failed ? 0 : bytes;
}

std::int64_t sane_ns(std::uint64_t stamp_ns) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(stamp_ns, latest_stamp_ns));
}

bool is_bag(const fs::path& file_or_folder) {
  std::error_code failed;
  if (!fs::is_directory(file_or_folder, failed)) {
    const fs::path extension = inner_extension(file_or_folder);
    return extension == ".mcap" || extension == ".db3" || extension == ".bag";
  }
  if (fs::is_regular_file(file_or_folder / "metadata.yaml", failed)) return true;
  fs::directory_iterator entry(file_or_folder, failed);
  for (; !failed && entry != fs::directory_iterator(); entry.increment(failed)) {
    const fs::path extension = inner_extension(entry->path());
    if (extension == ".mcap" || extension == ".db3") return true;
  }
  return false;
}

std::unique_ptr<BagReader> open_bag(const fs::path& file_or_folder, const Topics& topics) {
  std::error_code failed;
  if (fs::is_directory(file_or_folder, failed)) return open_rosbag2_folder(file_or_folder, topics);
  if (!fs::exists(file_or_folder, failed)) throw BagError(file_or_folder, "does not exist; check the path");
  const fs::path extension = inner_extension(file_or_folder);
  const bool is_packed = extension != file_or_folder.extension();
  if (is_packed && (extension != ".mcap" || !has_zstd()))
    throw BagError(file_or_folder, "is packed as a whole; unpack it with 'zstd -d' and name what comes out");
  if (extension == ".mcap") return open_mcap_bag(file_or_folder, topics);
  if (extension == ".db3") return open_sqlite_bag(file_or_folder, topics);
  if (extension == ".bag") return open_ros1_bag(file_or_folder, topics);
  throw BagError(file_or_folder,
                 "is no bag by its name: .mcap, .db3 and .bag are read, and rosbag2's folders");
}

}  // namespace alces::bags
