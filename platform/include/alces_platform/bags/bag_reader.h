// Bags of ROS, front to back: MCAP files, rosbag2 folders (metadata.yaml, split files) and SQLite files of
// ROS 2, and ROS 1's .bag (v2.0). Messages are handed on as they were recorded, in the file's order, which is
// that of their recording; SQLite's by their time.
//
// No index is needed. A bag that was cut is read as far as it is whole, what is damaged is passed over, and
// problems() says so. Lengths are believed only as far as there are bytes.
//
// Memory: the largest message, chunk or SQLite row, whatever the size of the bag. Uses the heap.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace alces::bags {

/// A bag that cannot be read at all: one sentence that names the file and what to do.
class BagError : public std::runtime_error {
 public:
  BagError(const std::filesystem::path& bag, const std::string& what_and_remedy)
      : std::runtime_error(bag.string() + ": " + what_and_remedy) {}
};

/// How a message's bytes are laid out; `other` is not read.
enum class Encoding : std::uint8_t { cdr, ros1, other };

struct Channel {
  std::string topic;
  std::string type;  ///< as ROS 1 writes it: "sensor_msgs/PointCloud2"
  Encoding encoding = Encoding::other;
  std::string encoding_name;  ///< as the bag has it, for people
  std::string definition;  ///< the type's definition (.msg, those of its fields behind it); empty: not known
};

struct Message {
  std::size_t channel = 0;             ///< of channels()
  std::int64_t log_time_ns = 0;        ///< when it was recorded; 0 to latest_stamp_ns
  std::span<const std::uint8_t> data;  ///< valid until the next call
};

class BagReader {
 public:
  static constexpr std::size_t most_problems = 20;
  static constexpr std::uint64_t largest_message_bytes = std::uint64_t{256} << 20;

  BagReader() = default;
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;
  virtual ~BagReader() = default;

  /// The next message of the topics asked for. False: no more. BagError when the disk fails.
  virtual bool next(Message& message) = 0;

  /// Those known so far: reading may add to them, never change them.
  [[nodiscard]] virtual const std::vector<Channel>& channels() const = 0;
  /// "MCAP", "rosbag2 (SQLite)", "ROS 1".
  [[nodiscard]] virtual std::string title() const = 0;
  /// Of total_bytes(), for showing progress.
  [[nodiscard]] virtual std::uint64_t bytes_read() const = 0;
  [[nodiscard]] virtual std::uint64_t total_bytes() const = 0;

  /// Sentences that name the file, the first most_problems of problem_count().
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
  [[nodiscard]] std::uint64_t problem_count() const { return problem_count_; }

 protected:
  void problem(const std::filesystem::path& file, const std::string& what);

 private:
  std::vector<std::string> problems_;
  std::uint64_t problem_count_ = 0;
};

/// Whether this is read as a bag: a file by its name (.mcap, .bag, .db3, these with .zstd), a folder by its
/// metadata.yaml or by .mcap and .db3 files in it. Reads nothing.
[[nodiscard]] bool is_bag(const std::filesystem::path& file_or_folder);

/// `topics`: only their messages are handed on, and of SQLite files only they are read; empty: all. BagError.
[[nodiscard]] std::unique_ptr<BagReader> open_bag(const std::filesystem::path& file_or_folder,
                                                  const std::set<std::string>& topics = {});

}  // namespace alces::bags
