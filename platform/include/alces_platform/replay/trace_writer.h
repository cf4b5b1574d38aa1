// Events into traces: a folder of them that gives back exactly the same events (trace_folder.h), or a single
// file for another program.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "alces_drivers/scanner/event.h"
#include "alces_platform/replay/gpiomon.h"

namespace alces::replay {

struct TraceWriterOptions {
  GpiomonForm gpiomon = GpiomonForm::libgpiod_2;
  std::vector<std::string> lines;  ///< the offset to write for each line; empty: the line's number
};

/// A text or binary file, buffered, that gets its name when it is whole: what is there before stays until
/// then. TraceWriteError when it cannot be written.
class TraceFile {
 public:
  explicit TraceFile(const std::filesystem::path& file);
  TraceFile(TraceFile&& other) noexcept;
  TraceFile& operator=(TraceFile&&) = delete;
  /// Without finish() nothing stays.
  ~TraceFile();
  void write(std::string_view bytes);
  void finish();

 private:
  std::ofstream stream_;
  std::string name_;
  std::string part_;  ///< what it is called until finish(); empty: a device, or finished
};

/// Whether a file of this name in a folder is a part of a drive, as TraceFolderWriter writes it.
[[nodiscard]] bool is_trace_name(std::string_view name);

class TraceFolderWriter final : public EventSink {
 public:
  /// Makes the folder; files of earlier traces in it go away. TraceWriteError.
  /// utc_offset_ns: UTC - the events' clock, kept in events.txt; 0: not known.
  TraceFolderWriter(std::filesystem::path folder, TraceWriterOptions options, std::int64_t utc_offset_ns = 0);

  void on_event(const Event& event) override;
  void write_configuration(std::string_view text);
  /// TraceWriteError when something could not be written.
  void finish();

  [[nodiscard]] std::uint64_t events() const { return events_; }
  /// Frames that no bus carries, and that candump's text therefore changes.
  [[nodiscard]] std::uint64_t frames_altered() const { return frames_altered_; }
  /// In the order of their names.
  [[nodiscard]] std::vector<std::string> files() const;

 private:
  TraceFile& file(const std::string& name);
  void write_frame(const Event& event);
  void write_bytes(const Event& event);

  std::filesystem::path folder_;
  TraceWriterOptions options_;
  std::map<std::string, TraceFile> files_;
  std::string line_;
  std::uint64_t events_ = 0;
  std::uint64_t frames_altered_ = 0;
};

/// What of a drive goes into one file, by its name: .log (all CAN frames), .txt (all edges), .bin (the bytes
/// received on the channel that the name begins with: laser_a, laser_b, gps), with a .times file beside it.
class TraceFileWriter final : public EventSink {
 public:
  /// TraceWriteError: the name says none of these.
  TraceFileWriter(const std::filesystem::path& file, TraceWriterOptions options);

  void on_event(const Event& event) override;
  void finish();

  [[nodiscard]] std::uint64_t events() const { return events_; }
  /// Those that this kind of file does not hold, ticks not counted.
  [[nodiscard]] std::uint64_t events_left_out() const { return events_left_out_; }

 private:
  enum class Kind : std::uint8_t { candump, gpiomon, bytes };

  TraceWriterOptions options_;
  Kind kind_ = Kind::candump;
  std::uint8_t channel_ = 0;
  std::vector<TraceFile> files_;
  std::string line_;
  std::uint64_t events_ = 0;
  std::uint64_t events_left_out_ = 0;
};

/// "laser_a", "laser_b", "gps"; the channel that a file's name begins with, or -1.
inline constexpr std::array<std::string_view, byte_channel_count> byte_channel_names = {"laser_a", "laser_b",
                                                                                        "gps"};
[[nodiscard]] int byte_channel_of(std::string_view file_name);

inline constexpr std::string_view order_name = "events.txt";
inline constexpr std::string_view order_head =
    "# alces events 1: the order in which these events were handed on, and what the other files do not "
    "hold\n";

inline constexpr std::string_view order_utc_offset = "# utc_offset_ns ";

}  // namespace alces::replay
