// A GPS receiver's NMEA 0183 sentences as text, one a line, with or without the time at which each came in
// front of it:
//
//   $GPGGA,123519.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47
//   1608.012345 $GPGGA,...            (also in round brackets)
//
// Without those times a sentence comes at its own time of day, counted from the first; sentences that have
// none come with the one before. Each sentence, with its line end, is one event on the GPS channel; checksums
// are the driver's matter.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::replay {

class NmeaTraceReader final : public EventSource {
 public:
  explicit NmeaTraceReader(const std::filesystem::path& file) : lines_(file) {}

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return lines_.name(); }
  [[nodiscard]] TraceProblems problems() const override { return problems_; }
  [[nodiscard]] std::uint64_t bytes_read() const override { return lines_.bytes_read(); }

  [[nodiscard]] static bool is_sentence(std::string_view line);

 private:
  LineReader lines_;
  std::string sentence_;
  std::int64_t last_stamp_ns_ = 0;
  std::int64_t last_time_of_day_ns_ = -1;
  TraceProblems problems_;
};

}  // namespace alces::replay
