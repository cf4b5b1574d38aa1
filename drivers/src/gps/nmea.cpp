#include "alces_drivers/gps/nmea.h"

#include <algorithm>
#include <cmath>

namespace alces::nmea {
namespace {

int hex_digit(char character) {
  if (character >= '0' && character <= '9') return character - '0';
  if (character >= 'A' && character <= 'F') return character - 'A' + 10;
  if (character >= 'a' && character <= 'f') return character - 'a' + 10;
  return -1;
}

/// The first `count` characters, all if there are fewer; string_view's substr() would bring an exception
/// along.
std::string_view head(std::string_view text, std::size_t count) {
  text.remove_suffix(text.size() - std::min(text.size(), count));
  return text;
}

bool is_digit(char character) {
  return character >= '0' && character <= '9';
}

/// [-]digits[.digits], at most 15 digits before the point; nothing else.
std::optional<double> decimal(std::string_view text) {
  const bool is_negative = !text.empty() && text.front() == '-';
  if (is_negative) text.remove_prefix(1);
  double value = 0;
  double unit = 1;
  std::size_t digits = 0;
  bool is_fraction = false;
  for (const char character : text) {
    if (character == '.' && !is_fraction) {
      is_fraction = true;
    } else if (is_digit(character) && digits < 30) {
      ++digits;
      if (is_fraction) {
        unit /= 10;
        value += unit * (character - '0');
      } else {
        value = 10 * value + (character - '0');
      }
    } else {
      return std::nullopt;
    }
  }
  if (digits == 0 || value > 1e15) return std::nullopt;
  return is_negative ? -value : value;
}

/// Splits at commas; fields that are not there are empty.
class Fields {
 public:
  explicit Fields(std::string_view line) {
    while (count_ < fields_.size()) {
      const std::size_t comma = line.find(',');
      fields_[count_++] = head(line, comma);
      if (comma == std::string_view::npos) return;
      line.remove_prefix(comma + 1);
    }
  }
  std::string_view operator[](std::size_t i) const { return i < count_ ? fields_[i] : std::string_view{}; }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::array<std::string_view, 24> fields_{};
  std::size_t count_ = 0;
};

/// hhmmss[.sss]
std::optional<std::int32_t> time_of_day_ms(std::string_view text) {
  const auto value = decimal(text);
  if (!value || text.size() < 6 || *value < 0) return std::nullopt;
  const auto whole = static_cast<std::int32_t>(std::min(*value, 999999.0));
  const std::int32_t hours = whole / 10000;
  const std::int32_t minutes = whole / 100 % 100;
  const double seconds = *value - (10000 * hours + 100 * minutes);
  if (hours > 23 || minutes > 59 || seconds >= 61) return std::nullopt;
  return (hours * 60 + minutes) * 60000 + static_cast<std::int32_t>(std::lround(seconds * 1000));
}

/// ddmm.mmmm or dddmm.mmmm and its letter.
std::optional<double> angle_deg(std::string_view text, std::string_view letter, char positive, char negative,
                                double limit_deg) {
  const auto value = decimal(text);
  if (!value || *value < 0 || letter.size() != 1 || (letter[0] != positive && letter[0] != negative)) {
    return std::nullopt;
  }
  const double degrees = std::floor(*value / 100);
  const double minutes = *value - 100 * degrees;
  const double angle = degrees + minutes / 60;
  if (minutes >= 60 || angle > limit_deg) return std::nullopt;
  return letter[0] == positive ? angle : -angle;
}

/// False: the fields are there but cannot be read. A receiver without a fix leaves them empty.
bool read_position(const Fields& fields, std::size_t first, Sentence& sentence) {
  if (fields[first].empty() && fields[first + 2].empty()) return true;
  const auto latitude = angle_deg(fields[first], fields[first + 1], 'N', 'S', 90);
  const auto longitude = angle_deg(fields[first + 2], fields[first + 3], 'E', 'W', 180);
  if (!latitude || !longitude) return false;
  sentence.latitude_deg = *latitude;
  sentence.longitude_deg = *longitude;
  sentence.has_position = true;
  return true;
}

void read_satellites(std::string_view field, Sentence& sentence) {
  const auto satellites = decimal(field);
  if (satellites && *satellites >= 0 && *satellites < 1000)
    sentence.satellites = static_cast<std::uint32_t>(*satellites);
}

/// Of GNS's mode, a letter a satellite system, the best one as GGA's number. Nothing: a letter that is none.
std::optional<std::uint32_t> best_quality(std::string_view modes) {
  struct Mode {
    char letter;
    std::uint32_t quality;
  };
  constexpr std::array<Mode, 9> best_first{
      {{'R', 4}, {'F', 5}, {'P', 2}, {'D', 2}, {'A', 1}, {'E', 6}, {'M', 7}, {'S', 8}, {'N', 0}}};
  if (modes.empty()) return std::nullopt;
  std::size_t best = best_first.size();
  for (const char letter : modes) {
    std::size_t place = 0;
    while (place < best_first.size() && best_first[place].letter != letter) ++place;
    if (place == best_first.size()) return std::nullopt;
    best = std::min(best, place);
  }
  return best_first[best].quality;
}

bool read_time(std::string_view field, Sentence& sentence) {
  sentence.time_of_day_ms = time_of_day_ms(field);
  return field.empty() || sentence.time_of_day_ms.has_value();
}

}  // namespace

std::optional<std::string_view> LineAssembler::push(std::uint8_t byte) {
  const char character = static_cast<char>(byte);
  if (character == '$') {
    if (is_inside_) ++counters_.cut_off;
    is_inside_ = true;
    size_ = 0;
    return std::nullopt;
  }
  if (!is_inside_) {
    if (character != '\r' && character != '\n') ++counters_.bytes_skipped;
    return std::nullopt;
  }
  if (character == '\r' || character == '\n') {
    is_inside_ = false;
    return finish();
  }
  if (byte < 0x20 || byte > 0x7e) {
    is_inside_ = false;
    counters_.bytes_skipped += size_ + 1;
    return std::nullopt;
  }
  if (size_ == line_.size()) {
    is_inside_ = false;
    ++counters_.too_long;
    return std::nullopt;
  }
  line_[size_++] = character;
  return std::nullopt;
}

std::optional<std::string_view> LineAssembler::finish() {
  const std::string_view line(line_.data(), size_);
  if (line.size() < 3 || line[line.size() - 3] != '*') {
    ++counters_.without_checksum;
    return std::nullopt;
  }
  const std::string_view content = head(line, line.size() - 3);
  unsigned sum = 0;
  for (const char character : content) sum ^= static_cast<unsigned char>(character);
  const int high = hex_digit(line[line.size() - 2]);
  const int low = hex_digit(line[line.size() - 1]);
  if (high < 0 || low < 0 || sum != static_cast<unsigned>(16 * high + low)) {
    ++counters_.checksum_errors;
    return std::nullopt;
  }
  ++counters_.lines;
  return content;
}

ParsedSentence parse(std::string_view line) {
  const Fields fields(line);
  const std::string_view address = fields[0];
  if (address.size() != 5 || address.front() == 'P') return {};
  std::string_view type = address;
  type.remove_prefix(2);
  Sentence sentence;
  if (type == "GGA") {
    if (fields.count() < 10 || !read_time(fields[1], sentence) || !read_position(fields, 2, sentence)) {
      return {std::nullopt, true};
    }
    const auto quality = decimal(fields[6]);
    if (!quality || *quality < 0 || *quality > 9) return {std::nullopt, true};
    sentence.quality = static_cast<std::uint32_t>(*quality);
    read_satellites(fields[7], sentence);
    sentence.hdop = decimal(fields[8]);
    sentence.altitude_m = decimal(fields[9]);
    if (const auto geoid_m = decimal(fields[11]); sentence.altitude_m && geoid_m)
      *sentence.altitude_m += *geoid_m;
    return {sentence, false};
  }
  if (type == "GNS") {
    sentence.kind = SentenceKind::gns;
    const auto quality = best_quality(fields[6]);
    if (fields.count() < 11 || !read_time(fields[1], sentence) || !read_position(fields, 2, sentence) ||
        !quality)
      return {std::nullopt, true};
    sentence.quality = *quality;
    read_satellites(fields[7], sentence);
    sentence.hdop = decimal(fields[8]);
    sentence.altitude_m = decimal(fields[9]);
    if (const auto geoid_m = decimal(fields[10]); sentence.altitude_m && geoid_m)
      *sentence.altitude_m += *geoid_m;
    return {sentence, false};
  }
  if (type == "RMC") {
    sentence.kind = SentenceKind::rmc;
    if (fields.count() < 9 || !read_time(fields[1], sentence) || !read_position(fields, 3, sentence)) {
      return {std::nullopt, true};
    }
    sentence.quality = fields[2] == "A" ? 1 : 0;
    return {sentence, false};
  }
  return {};
}

}  // namespace alces::nmea
