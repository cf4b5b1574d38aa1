// ROS 1's bags, version 2.0 (https://wiki.ros.org/Bags/Format/2.0): records of a header (fields NAME=VALUE,
// each behind its length) and data. Chunks hold connections and messages, packed by nothing, bz2 or lz4. Read
// front to back, so that no index is needed: a bag that was never closed is read as well as any other.
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <string_view>

#include "alces_platform/recording/byte_writer.h"
#include "bag_files.h"
#include "unpack_ros1.h"

namespace alces::bags {
namespace {

namespace fs = std::filesystem;
using Bytes = std::span<const std::uint8_t>;

constexpr std::string_view version_line = "#ROSBAG V2.0\n";
constexpr std::uint32_t largest_header_bytes = std::uint32_t{1} << 20;
constexpr std::uint32_t largest_chunk_bytes = std::uint32_t{1} << 30;

enum class Op : std::uint8_t {
  message = 2,
  bag_header = 3,
  index = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7
};

/// The fields of a record's header.
class Fields {
 public:
  explicit Fields(Bytes header) {
    ByteReader in(header);
    while (in.left() > 0) {
      const std::string_view field = in.string();
      const std::size_t equals = field.find('=');
      if (in.failed() || equals == std::string_view::npos) {
        is_damaged_ = true;
        return;
      }
      values_.emplace(field.substr(0, equals), field.substr(equals + 1));
    }
  }

  [[nodiscard]] bool is_damaged() const { return is_damaged_; }
  [[nodiscard]] std::string_view text(std::string_view name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string_view() : found->second;
  }
  template <typename Number>
  [[nodiscard]] bool number(std::string_view name, Number& value) const {
    const std::string_view bytes = text(name);
    if (bytes.size() != sizeof value) return false;
    std::memcpy(&value, bytes.data(), sizeof value);
    return true;
  }
  [[nodiscard]] Op op() const {
    std::uint8_t op = 0;
    static_cast<void>(number("op", op));
    return static_cast<Op>(op);
  }

 private:
  std::map<std::string_view, std::string_view> values_;
  bool is_damaged_ = false;
};

class Ros1Bag final : public BagReader {
 public:
  Ros1Bag(const fs::path& file, const Topics& topics)
      : file_(file), topics_(topics), total_bytes_(size_of(file)), disk_(file.c_str()) {
    if (!disk_.is_open())
      throw BagError(file, std::string("cannot be opened (") + std::strerror(disk_.error_number()) + ")");
    const Bytes start = take(version_line.size());
    const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
    if (text == version_line) return;
    if (text.starts_with("#ROSBAG V"))
      throw BagError(file, "is a bag of another version than 2.0; 'rosbag fix' makes one of today's of it");
    throw BagError(file, text.empty() ? "is empty; nothing was recorded"
                                      : "is no bag of ROS 1 (its first bytes are others)");
  }

  bool next(Message& message) override {
    for (;;) {
      while (!chunk_.empty()) {
        if (read_in_chunk(message)) return true;
      }
      if (!read_record(message)) return false;
      if (has_loose_message_) {
        has_loose_message_ = false;
        return true;
      }
    }
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] std::string title() const override { return "ROS 1"; }
  [[nodiscard]] std::uint64_t bytes_read() const override { return position_; }
  [[nodiscard]] std::uint64_t total_bytes() const override { return total_bytes_; }

 private:
  /// The next `size` bytes of the file, fewer at its end; valid until the next call. Grows as bytes arrive,
  /// so that an absurd length costs nothing.
  Bytes take(std::size_t size) {
    constexpr std::size_t step_bytes = std::size_t{4} << 20;
    std::size_t filled = 0;
    while (filled < size) {
      const std::size_t step = std::min(size - filled, step_bytes);
      if (buffer_.size() < filled + step) buffer_.resize(filled + step);
      const std::size_t got = disk_.read(std::span(buffer_).subspan(filled, step));
      filled += got;
      if (got < step) break;
    }
    if (disk_.error_number() != 0)
      throw BagError(file_, std::string("cannot be read to its end (") + std::strerror(disk_.error_number()) +
                                "); check the disk");
    position_ += filled;
    return Bytes(buffer_).first(filled);
  }

  bool end(const std::string& what) {
    if (!what.empty()) problem(file_, what);
    is_over_ = true;
    return false;
  }
  bool cut() { return end("was cut at byte " + std::to_string(position_) + "; what came before is read"); }

  /// One length of 32 bits. False: the file ends here.
  bool take_length(std::uint32_t& length, bool& is_end) {
    const Bytes bytes = take(sizeof length);
    is_end = bytes.empty();
    if (bytes.size() < sizeof length) return false;
    std::memcpy(&length, bytes.data(), sizeof length);
    return true;
  }

  /// One record of the file itself. False: the end.
  bool read_record(Message& message) {
    if (is_over_) return false;
    const std::uint64_t begin = position_;
    std::uint32_t header_bytes = 0;
    bool is_end = false;
    if (!take_length(header_bytes, is_end)) {
      if (!is_end) return cut();
      return end(has_index_ || channels_.empty()
                     ? ""
                     : "has no index, it was not closed when it was recorded; all of "
                       "it is read all the same");
    }
    if (header_bytes > largest_header_bytes) return end(nonsense(begin));
    const Bytes header = take(header_bytes);
    if (header.size() < header_bytes) return cut();
    header_.assign(header.begin(), header.end());
    const Fields fields{Bytes(header_)};
    std::uint32_t data_bytes = 0;
    if (!take_length(data_bytes, is_end)) return cut();
    if (fields.is_damaged() || data_bytes > largest_chunk_bytes) return end(nonsense(begin));
    const Bytes data = take(data_bytes);
    const bool is_cut = data.size() < data_bytes;
    switch (fields.op()) {
      case Op::chunk:
        open_chunk(fields, data, is_cut);
        break;
      case Op::connection:
        if (!is_cut) add_connection(fields, data);
        break;
      case Op::message:
        if (!is_cut) has_loose_message_ = take_message(fields, data, message);
        break;
      case Op::bag_header:
        if (!fields.text("encryptor").empty())
          throw BagError(file_, "is encrypted; 'rosbag decrypt' makes a file that can be read");
        break;
      case Op::chunk_info:
        has_index_ = true;
        break;
      case Op::index:
        break;
      default:
        return end(nonsense(begin));
    }
    if (!is_cut) return true;
    cut();
    return !chunk_.empty();
  }

  [[nodiscard]] static std::string nonsense(std::uint64_t at) {
    return "is damaged at byte " + std::to_string(at) + ": no record begins there; what came before is read";
  }

  void open_chunk(const Fields& fields, Bytes data, bool is_cut) {
    const std::string compression(fields.text("compression"));
    std::uint32_t size = 0;
    if (!fields.number("size", size) || size > largest_chunk_bytes) {
      problem(file_, "has a chunk without a size before byte " + std::to_string(position_) +
                         "; its messages are missing");
      return;
    }
    chunk_is_cut_ = is_cut;
    chunk_end_ = position_;
    if (compression == "none") {
      chunk_ = data;
      return;
    }
    if (!can_unpack_ros1(compression)) {
      problem(file_,
              "has a chunk packed by '" + compression.substr(0, 40) +
                  "', which is not supported; its messages are missing ('rosbag decompress' makes a file "
                  "that can be read)");
      return;
    }
    const bool is_whole = unpack_ros1(compression, data, size, unpacked_);
    if (!is_whole && !is_cut)
      problem(file_, "has a damaged chunk (" + compression + ") before byte " + std::to_string(position_) +
                         "; what could be unpacked of it is read");
    chunk_is_cut_ = !is_whole;
    chunk_ = unpacked_;
  }

  /// True: it is a message.
  bool read_in_chunk(Message& message) {
    ByteReader in(chunk_);
    const Bytes header = in.bytes(in.u32());
    const Bytes data = in.bytes(in.u32());
    const Fields fields{header};
    if (in.failed() || fields.is_damaged()) {
      if (!chunk_is_cut_)
        problem(file_, "has a chunk before byte " + std::to_string(chunk_end_) +
                           " whose records do not fit it; the rest of it is missing");
      chunk_ = {};
      return false;
    }
    chunk_ = chunk_.subspan(in.position());
    if (fields.op() == Op::connection) add_connection(fields, data);
    return fields.op() == Op::message && take_message(fields, data, message);
  }

  void add_connection(const Fields& fields, Bytes data) {
    std::uint32_t id = 0;
    const Fields connection{data};
    if (!fields.number("conn", id) || connection.is_damaged()) {
      if (bad_connections_++ == 0) problem(file_, "has a damaged connection; its messages are missing");
      return;
    }
    if (places_.contains(id)) return;  // told again at the end
    places_.emplace(id, channels_.size());
    channels_.push_back({std::string(fields.text("topic")), std::string(connection.text("type")),
                         Encoding::ros1, "ros1", std::string(connection.text("message_definition"))});
  }

  bool take_message(const Fields& fields, Bytes data, Message& message) {
    std::uint32_t id = 0;
    std::uint64_t time = 0;
    if (!fields.number("conn", id) || !fields.number("time", time)) {
      if (bad_messages_++ == 0) problem(file_, "has messages without a connection or a time; left out");
      return false;
    }
    const auto place = places_.find(id);
    if (place == places_.end()) {
      if (bad_messages_++ == 0)
        problem(file_, "has messages of a connection that it does not describe; left out");
      return false;
    }
    if (!is_asked_for(topics_, channels_[place->second].topic)) return false;
    constexpr std::uint64_t ns_a_second = 1'000'000'000;
    message = {place->second, sane_ns((time & 0xffffffffU) * ns_a_second + (time >> 32)), data};
    return true;
  }

  fs::path file_;
  Topics topics_;
  std::uint64_t total_bytes_;
  FileSource disk_;
  std::uint64_t position_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint8_t> header_;
  std::vector<std::uint8_t> unpacked_;
  Bytes chunk_;  ///< records of the current chunk that are still to be read
  std::uint64_t chunk_end_ = 0;
  bool chunk_is_cut_ = false;
  bool has_loose_message_ = false;
  bool has_index_ = false;
  bool is_over_ = false;
  std::uint64_t bad_connections_ = 0;
  std::uint64_t bad_messages_ = 0;
  std::map<std::uint32_t, std::size_t> places_;
  std::vector<Channel> channels_;
};

}  // namespace

std::unique_ptr<BagReader> open_ros1_bag(const fs::path& file, const Topics& topics) {
  return std::make_unique<Ros1Bag>(file, topics);
}

}  // namespace alces::bags
