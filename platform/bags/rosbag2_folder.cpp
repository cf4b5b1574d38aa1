// A folder that 'ros2 bag record' writes: metadata.yaml and the files that it names, of which there are
// several where the recording was split.
#include <algorithm>
#include <map>
#include <system_error>

#include "bag_files.h"
#include "rosbag2_metadata.h"
#include "zstd_source.h"

namespace alces::bags {
namespace {

namespace fs = std::filesystem;

bool digits_less(const fs::path& a, const fs::path& b) {
  const std::string left = a.filename().string();
  const std::string right = b.filename().string();
  return left.size() != right.size() ? left.size() < right.size() : left < right;  // bag_9 before bag_10
}

std::vector<fs::path> bag_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (; !failed && entry != fs::directory_iterator(); entry.increment(failed)) {
    std::error_code ignored;
    if (!entry->is_directory(ignored) && is_bag(entry->path()) && entry->path().extension() != ".bag")
      files.push_back(entry->path());
  }
  if (failed) throw BagError(folder, "the folder cannot be read (" + failed.message() + ")");
  std::sort(files.begin(), files.end(), digits_less);
  return files;
}

class Rosbag2Folder final : public BagReader {
 public:
  Rosbag2Folder(const fs::path& folder, const Topics& topics) : folder_(folder), topics_(topics) {
    read_metadata();
    for (const fs::path& file : files_) total_bytes_ += size_of(file);
    if (!open_next())
      throw BagError(folder, "none of its files can be read: " +
                                 (problems().empty() ? "there are none" : problems().front()));
  }

  bool next(Message& message) override {
    while (part_) {
      if (part_->next(message)) {
        message.channel = place_of(message.channel);
        if (!packs_messages_) return true;
        if (unzstd(message.data, unpacked_)) {
          message.data = unpacked_;
          return true;
        }
        if (bad_messages_++ == 0) problem(folder_, "has packed messages that are damaged; left out");
        continue;
      }
      close_part();
      open_next();
    }
    return false;
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] std::string title() const override { return title_; }
  [[nodiscard]] std::uint64_t bytes_read() const override {
    return bytes_before_ + (part_ ? part_->bytes_read() : 0);
  }
  [[nodiscard]] std::uint64_t total_bytes() const override { return total_bytes_; }

 private:
  void read_metadata() {
    std::error_code failed;
    const fs::path file = folder_ / "metadata.yaml";
    Rosbag2Metadata metadata;
    if (fs::is_regular_file(file, failed)) {
      std::string what;
      if (!read_rosbag2_metadata(file, metadata, what)) problem(file, what);
    } else {
      problem(folder_,
              "has no metadata.yaml; its files are taken in the order of their names ('ros2 bag reindex' "
              "makes one)");
    }
    packs_messages_ = metadata.compression_mode == "message";
    if (packs_messages_ && (metadata.compression_format != "zstd" || !has_zstd()))
      throw BagError(folder_, "its messages are packed by '" + metadata.compression_format +
                                  "', which is not supported; 'ros2 bag convert' unpacks them");
    for (const std::string& name : metadata.files) {
      // older recorders wrote the folder's name before it
      fs::path path = folder_ / fs::path(name).filename();
      if (!fs::exists(path, failed)) {
        const fs::path packed = path.string() + ".zstd";
        if (!fs::exists(packed, failed)) {
          problem(path, "is missing, and metadata.yaml names it; its messages are missing");
          continue;
        }
        path = packed;
      }
      files_.push_back(path);
    }
    if (files_.empty()) files_ = bag_files_in(folder_);
    if (files_.empty())
      throw BagError(folder_, "is a bag by its metadata.yaml, and the files that it names are not there: " +
                                  (metadata.files.empty() ? "none" : metadata.files.front()));
  }

  /// The next file that can be opened.
  bool open_next() {
    while (next_file_ < files_.size()) {
      const fs::path& file = files_[next_file_++];
      try {
        part_ = open_bag(file, topics_);
      } catch (const BagError& error) {
        problem(folder_, std::string(error.what()) + "; its messages are missing");
        bytes_before_ += size_of(file);
        continue;
      }
      places_.clear();
      if (title_.empty()) title_ = part_->title().starts_with("MCAP") ? "rosbag2 (MCAP)" : part_->title();
      for (std::size_t i = 0; i < part_->channels().size(); ++i) static_cast<void>(place_of(i));
      return true;
    }
    part_.reset();
    return false;
  }

  void close_part() {
    bytes_before_ += part_->total_bytes();
    for (const std::string& sentence : part_->problems()) {
      const std::size_t name = sentence.find(": ");
      problem(sentence.substr(0, name), sentence.substr(name + 2));
    }
  }

  /// The part's channel among those of all parts.
  std::size_t place_of(std::size_t channel) {
    while (places_.size() <= channel) {
      const Channel& read = part_->channels()[places_.size()];
      const auto known = std::find_if(channels_.begin(), channels_.end(), [&](const Channel& each) {
        return each.topic == read.topic && each.type == read.type && each.encoding == read.encoding;
      });
      places_.push_back(static_cast<std::size_t>(known - channels_.begin()));
      if (known == channels_.end()) channels_.push_back(read);
    }
    return places_[channel];
  }

  fs::path folder_;
  Topics topics_;
  std::vector<fs::path> files_;
  std::size_t next_file_ = 0;
  bool packs_messages_ = false;
  std::uint64_t total_bytes_ = 0;
  std::uint64_t bytes_before_ = 0;
  std::uint64_t bad_messages_ = 0;
  std::string title_;
  std::unique_ptr<BagReader> part_;
  std::vector<std::size_t> places_;
  std::vector<Channel> channels_;
  std::vector<std::uint8_t> unpacked_;
};

}  // namespace

std::unique_ptr<BagReader> open_rosbag2_folder(const fs::path& folder, const Topics& topics) {
  return std::make_unique<Rosbag2Folder>(folder, topics);
}

}  // namespace alces::bags
