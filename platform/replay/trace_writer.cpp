#include "alces_platform/replay/trace_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "alces_platform/replay/candump.h"
#include "alces_platform/replay/raw_bytes.h"

namespace alces::replay {
namespace {

std::string offset_of(const TraceWriterOptions& options, std::uint8_t line) {
  return line < options.lines.size() ? options.lines[line] : std::to_string(line);
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string bus_name(std::uint8_t bus) {
  std::string name("can");
  return name += std::to_string(bus);
}

std::string link_name(const Event& event) {
  if (event.kind == EventKind::can_link) return bus_name(event.channel);
  return event.channel < byte_channel_names.size() ? std::string(byte_channel_names[event.channel])
                                                   : "bytes" + std::to_string(event.channel);
}

/// So that a power cut leaves the old file or the new one.
void sync_to_disk(const std::string& file, const std::string& name) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  int error_number = descriptor < 0 ? errno : 0;
  while (error_number == 0 && ::fsync(descriptor) != 0) {
    if (errno != EINTR) error_number = errno;
  }
  if (descriptor >= 0) ::close(descriptor);
  if (error_number != 0)
    throw TraceWriteError(name + ": cannot be written (" + std::strerror(error_number) + ")");
}

}  // namespace

int byte_channel_of(std::string_view file_name) {
  for (std::size_t channel = 0; channel < byte_channel_names.size(); ++channel) {
    if (file_name.starts_with(byte_channel_names[channel])) return static_cast<int>(channel);
  }
  return -1;
}

TraceFile::TraceFile(const std::filesystem::path& file) : name_(file.string()) {
  std::error_code ignored;
  const bool is_device =
      std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored);
  if (!is_device) part_ = name_ + ".part";
  stream_.open(is_device ? name_ : part_, std::ios::binary | std::ios::trunc);
  if (stream_) return;
  part_.clear();
  std::string sentence = name_;
  sentence += ": cannot be written (";
  sentence += std::strerror(errno);
  throw TraceWriteError(sentence + ")");
}

TraceFile::TraceFile(TraceFile&& other) noexcept
    : stream_(std::move(other.stream_)),
      name_(std::move(other.name_)),
      part_(std::exchange(other.part_, std::string())) {}

TraceFile::~TraceFile() {
  if (part_.empty()) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

void TraceFile::write(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream_) throw TraceWriteError(name_ + ": cannot be written; is the disk full?");
}

void TraceFile::finish() {
  stream_.close();
  if (!stream_) throw TraceWriteError(name_ + ": cannot be written; is the disk full?");
  if (part_.empty()) return;
  sync_to_disk(part_, name_);
  std::error_code error;
  std::filesystem::rename(part_, name_, error);
  if (error) throw TraceWriteError(name_ + ": cannot be written (" + error.message() + ")");
  part_.clear();
}

bool is_trace_name(std::string_view name) {
  if (name.ends_with(".part")) name.remove_suffix(5);  // of a writer that was killed
  return name == order_name || name == "gpio.txt" || name == "vehicle.toml" ||
         (name.starts_with("can") && name.ends_with(".log")) ||
         (byte_channel_of(name) >= 0 &&
          (name.ends_with(".bin") || name.ends_with(".times") || name.ends_with(".nmea")));
}

TraceFolderWriter::TraceFolderWriter(std::filesystem::path folder, TraceWriterOptions options,
                                     std::int64_t utc_offset_ns)
    : folder_(std::move(folder)), options_(std::move(options)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error || !std::filesystem::is_directory(folder_))
    throw TraceWriteError(folder_.string() + ": the folder cannot be made (" +
                          (error ? error.message() : std::string("a file is in the way")) + ")");
  // What an earlier drive left would be taken for a part of this one.
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder_)) {
    if (is_trace_name(entry.path().filename().string()) && entry.is_regular_file())
      std::filesystem::remove(entry.path(), error);
  }
  TraceFile& order = file(std::string(order_name));
  order.write(order_head);
  if (utc_offset_ns != 0) {
    std::string line(order_utc_offset);
    line += std::to_string(utc_offset_ns);
    order.write(line += '\n');
  }
}

TraceFile& TraceFolderWriter::file(const std::string& name) {
  const auto found = files_.find(name);
  return found != files_.end() ? found->second : files_.try_emplace(name, folder_ / name).first->second;
}

std::vector<std::string> TraceFolderWriter::files() const {
  std::vector<std::string> names;
  for (const auto& [name, file] : files_) names.push_back(name);
  return names;
}

void TraceFolderWriter::write_configuration(std::string_view text) {
  file("vehicle.toml").write(text);
}

void TraceFolderWriter::write_frame(const Event& event) {
  const std::string name = bus_name(event.channel);
  line_.clear();
  append_candump(line_, event, name);
  Event back;
  const std::string_view without_end(line_.data(), line_.size() - 1);
  if (!CandumpReader::is_frame(without_end, back) || back.frame != event.frame) ++frames_altered_;
  file(name + ".log").write(line_);
}

void TraceFolderWriter::write_bytes(const Event& event) {
  std::string name(byte_channel_names[event.channel % byte_channel_names.size()]);
  if (event.kind == EventKind::bytes_sent) name += ".sent";
  file(name + ".bin").write(text_of(event.bytes));
  line_.clear();
  append_time(line_, event.stamp_ns, event.bytes.size());
  file(name + ".times").write(line_);
}

void TraceFolderWriter::on_event(const Event& event) {
  ++events_;
  std::string order = std::to_string(event.stamp_ns);
  const auto add = [&order](std::uint64_t number) {
    order += ' ';
    order += std::to_string(number);
  };
  order += ' ';
  switch (event.kind) {
    case EventKind::tick:
      order += "tick";
      break;
    case EventKind::stop:
      order += "stop";
      break;
    case EventKind::order:
      order += "order";
      add(static_cast<std::uint8_t>(event.order));
      add(event.is_up ? 1 : 0);
      break;
    case EventKind::sync_sent:
      order += "sync_sent";
      add(event.channel);
      break;
    case EventKind::can_frame:
    case EventKind::can_sent:
      write_frame(event);
      order += bus_name(event.channel);
      break;
    case EventKind::can_link:
    case EventKind::byte_link:
      order += link_name(event);
      order += event.is_up ? " up" : " down";
      break;
    case EventKind::edge:
      line_.clear();
      append_gpiomon(line_, event, offset_of(options_, event.edge.line), options_.gpiomon);
      file("gpio.txt").write(line_);
      order += "edge";
      add(event.channel);
      add(event.edge.line);
      add(event.edge.sequence);
      break;
    case EventKind::edges_lost:
      order += "edges_lost";
      add(event.channel);
      add(event.edge.line);
      add(event.lost_count);
      break;
    case EventKind::bytes:
    case EventKind::bytes_sent:
      write_bytes(event);
      order += byte_channel_names[event.channel % byte_channel_names.size()];
      if (event.kind == EventKind::bytes_sent) order += ".sent";
      break;
  }
  order += '\n';
  file(std::string(order_name)).write(order);
}

void TraceFolderWriter::finish() {
  for (auto& [name, file] : files_) file.finish();
}

TraceFileWriter::TraceFileWriter(const std::filesystem::path& file, TraceWriterOptions options)
    : options_(std::move(options)) {
  const std::string extension = file.extension().string();
  if (extension == ".log") {
    kind_ = Kind::candump;
  } else if (extension == ".txt") {
    kind_ = Kind::gpiomon;
  } else if (extension == ".bin") {
    const int channel = byte_channel_of(file.filename().string());
    if (channel < 0)
      throw TraceWriteError(file.string() +
                            ": whose bytes these are to be is not clear; begin the name with laser_a, "
                            "laser_b or gps");
    kind_ = Kind::bytes;
    channel_ = static_cast<std::uint8_t>(channel);
  } else {
    throw TraceWriteError(file.string() +
                          ": what to write is not clear; end the name in .log (candump), .txt (gpiomon) "
                          "or .bin (raw bytes), in .mcap, or name a folder");
  }
  files_.emplace_back(file);
  if (kind_ == Kind::bytes) files_.emplace_back(std::filesystem::path(file).replace_extension(".times"));
}

void TraceFileWriter::on_event(const Event& event) {
  line_.clear();
  if (kind_ == Kind::candump && (event.kind == EventKind::can_frame || event.kind == EventKind::can_sent)) {
    append_candump(line_, event, bus_name(event.channel));
    files_[0].write(line_);
  } else if (kind_ == Kind::gpiomon && event.kind == EventKind::edge) {
    append_gpiomon(line_, event, offset_of(options_, event.edge.line), options_.gpiomon);
    files_[0].write(line_);
  } else if (kind_ == Kind::bytes && event.kind == EventKind::bytes && event.channel == channel_) {
    append_time(line_, event.stamp_ns, event.bytes.size());
    files_[0].write(text_of(event.bytes));
    files_[1].write(line_);
  } else {
    const bool was_on_a_wire = event.kind != EventKind::tick && event.kind != EventKind::stop &&
                               event.kind != EventKind::order && event.kind != EventKind::sync_sent;
    if (was_on_a_wire) ++events_left_out_;
    return;
  }
  ++events_;
}

void TraceFileWriter::finish() {
  for (TraceFile& file : files_) file.finish();
}

}  // namespace alces::replay
