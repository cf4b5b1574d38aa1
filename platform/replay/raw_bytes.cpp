#include "alces_platform/replay/raw_bytes.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "alces_drivers/stamp.h"

namespace alces::replay {

RawBytesReader::RawBytesReader(const std::filesystem::path& bytes, const std::filesystem::path& times,
                               RawBytesOptions options)
    : stream_(bytes, std::ios::binary),
      name_(bytes.string()),
      options_(options),
      last_stamp_ns_(options.begin_ns) {
  if (!stream_) {
    std::string sentence = name_;
    sentence += ": cannot be opened (";
    sentence += std::strerror(errno);
    throw TraceError(sentence + ")");
  }
  if (std::filesystem::exists(times)) times_.emplace(times);
  options_.baud = std::max<std::uint32_t>(options_.baud, 1);
}

bool RawBytesReader::next_time(std::int64_t& stamp_ns, std::size_t& size) {
  std::string_view line;
  while (times_->next(line)) {
    Words words(line);
    const std::string_view first = words.next();
    if (first.empty() || first.front() == '#') continue;
    std::uint64_t count = 0;
    if (!parse_signed(first, stamp_ns) || !parse_unsigned(words.next(), count) || count > largest_piece ||
        !words.rest().empty()) {
      problems_.add(times_->problem("a line is 'stamp_ns byte_count', at most 64 MiB"));
      continue;
    }
    size = static_cast<std::size_t>(count);
    return true;
  }
  return false;
}

bool RawBytesReader::next(Event& event) {
  std::int64_t stamp_ns = 0;
  std::size_t size = 0;
  const bool has_time = times_ && !times_ended_ && next_time(stamp_ns, size);
  if (!has_time) {
    const std::int64_t bytes_per_piece = std::int64_t{options_.baud} / 10 * piece_ns / ns_per_s;
    size = static_cast<std::size_t>(std::clamp<std::int64_t>(bytes_per_piece, 1, largest_piece));
  }
  piece_.resize(size);
  stream_.read(reinterpret_cast<char*>(piece_.data()), static_cast<std::streamsize>(size));
  if (stream_.bad())
    throw TraceError(name_ + ": cannot be read on; what comes after is unknown, check the disk");
  const auto got = static_cast<std::size_t>(stream_.gcount());
  piece_.resize(got);
  bytes_read_ += got;
  if (has_time && got < size)
    problems_.add(
        times_->problem("the bytes end " + std::to_string(size - got) + " bytes before this line's"));
  if (got == 0 && !(has_time && size == 0)) return false;
  if (times_ && !has_time && !times_ended_) {
    problems_.add(name_ + ": has more bytes than its .times file says; the rest comes at " +
                  std::to_string(options_.baud) + " baud");
    times_ended_ = true;
  }
  if (!has_time) {
    const std::int64_t duration_ns = static_cast<std::int64_t>(got) * 10 * ns_per_s / options_.baud;
    stamp_ns = last_stamp_ns_ > INT64_MAX - duration_ns ? INT64_MAX : last_stamp_ns_ + duration_ns;
  }
  last_stamp_ns_ = stamp_ns;
  event = {};
  event.kind = options_.is_sent ? EventKind::bytes_sent : EventKind::bytes;
  event.channel = options_.channel;
  event.stamp_ns = stamp_ns;
  event.bytes = piece_;
  return true;
}

void append_time(std::string& text, std::int64_t stamp_ns, std::size_t size) {
  text += std::to_string(stamp_ns);
  text += ' ';
  text += std::to_string(size);
  text += '\n';
}

}  // namespace alces::replay
