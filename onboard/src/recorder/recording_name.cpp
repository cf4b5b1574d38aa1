#include "alces_onboard/recorder/recording_name.h"

#include <array>
#include <ctime>
#include <system_error>

#include "alces_drivers/stamp.h"

namespace alces::onboard {

std::string expand_recording_name(const std::string& name, std::int64_t utc_ns) {
  const auto utc_s = static_cast<std::time_t>(utc_ns / ns_per_s);
  std::tm utc{};
  gmtime_r(&utc_s, &utc);
  std::array<char, 32> time{};
  const std::size_t size = std::strftime(time.data(), time.size(), "%Y%m%dT%H%M%SZ", &utc);
  std::string expanded;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char next = name[i] == '%' && i + 1 < name.size() ? name[i + 1] : '\0';
    if (next == 't') {
      expanded.append(time.data(), size);
      ++i;
    } else if (next == '%') {
      expanded += '%';
      ++i;
    } else {
      expanded += name[i];
    }
  }
  return expanded;
}

std::filesystem::path unused_name(const std::filesystem::path& file) {
  std::error_code ignored;
  std::filesystem::path candidate = file;
  for (int number = 2; std::filesystem::exists(candidate, ignored); ++number) {
    candidate = file;
    candidate.replace_filename(file.stem().string() + "-" + std::to_string(number) +
                               file.extension().string());
  }
  return candidate;
}

}  // namespace alces::onboard
