// libgpiod's text: what gpiomon writes for each edge.
//
//   event:  RISING EDGE offset: 3 timestamp: [    1608.012345678]     libgpiod 1
//   1608.012345678	rising	gpiochip0 3                               libgpiod 2, a line without a name
//   1608.012345678	rising	"index"                                    with a name (or without the quotes:
//   --unquoted) 2023-01-05T12:34:56.123456789Z	rising	gpiochip0 3 "index"        --utc or --localtime,
//   --chip
//
// Sequence numbers are in neither: edges that the kernel lost do not show. Source: libgpiod, tools/gpiomon.c
// and tools-common.c, 1.6 and 2.1.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::replay {

struct GpiomonOptions {
  /// The offset ("3") or name ("index") of each configured line, in their order. Empty: the offset is the
  /// line's number.
  std::vector<std::string> lines;
};

enum class GpiomonForm : std::uint8_t { libgpiod_1, libgpiod_2 };

class GpiomonReader final : public EventSource {
 public:
  /// TraceError when the file cannot be opened.
  explicit GpiomonReader(const std::filesystem::path& file, GpiomonOptions options = {});

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return lines_.name(); }
  [[nodiscard]] TraceProblems problems() const override { return problems_; }
  [[nodiscard]] std::uint64_t bytes_read() const override { return lines_.bytes_read(); }

  [[nodiscard]] static bool is_edge(std::string_view line);

 private:
  LineReader lines_;
  GpiomonOptions options_;
  TraceProblems problems_;
};

/// One edge with the line's end; `line`: its offset. All nine decimals are there.
void append_gpiomon(std::string& text, const Event& event, std::string_view line, GpiomonForm form);

}  // namespace alces::replay
