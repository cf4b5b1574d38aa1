#include "alces_platform/linux/gpio/gpio_lines.h"

#include <sys/epoll.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace alces {
namespace {

constexpr int rounds_at_once = 8;  ///< of reads, before others in the loop have their turn

/// Tells a chip's file from that of another one that came under the same name; 0: there is none.
std::uint64_t file_of(const char* path) {
  struct stat file {};
  return stat(path, &file) == 0 ? file.st_ino : 0;
}

}  // namespace

GpioLines::GpioLines(EventLoop& loop, const GpioConfig& config, ClockReader& clocks)
    : loop_(loop),
      chip_(config.chip),
      consumer_(config.consumer),
      line_count_(std::min(config.lines.size(), GpioRequest::line_capacity)),
      has_too_many_lines_(config.lines.size() > GpioRequest::line_capacity),
      first_line_(config.first_line),
      clocks_(clocks),
      bridge_(clocks) {
  for (std::size_t i = 0; i < line_count_; ++i) {
    lines_[i] = config.lines[i];
    line_names_[i] = Name(config.lines[i].line);
    lines_[i].line = line_names_[i].text();
    checks_[i] = EdgeCheck(lines_[i].edges == GpioEdges::both);
  }
}

bool GpioLines::open() {
  close();
  if (has_too_many_lines_ || line_count_ == 0) {
    error_.set("%s: between 1 and %zu lines can be asked for", chip_.text(), GpioRequest::line_capacity);
    return false;
  }
  if (!loop_.attach(*this)) {
    error_.set("%s: the event loop has no room for one more device", chip_.text());
    return false;
  }
  is_wanted_ = true;
  if (try_open()) return true;
  back_off_.failed(clocks_.monotonic_ns());
  return false;
}

void GpioLines::close() {
  release();
  if (is_wanted_) loop_.detach(*this);
  is_wanted_ = false;
  back_off_.reset();
}

void GpioLines::release() {
  for (EventLoop::Watch& watch : watches_) loop_.unwatch(watch);
  request_.close();
}

bool GpioLines::try_open() {
  if (!find_gpio_chip(chip_.text(), path_, error_)) return false;
  file_ = file_of(path_.text());
  looked_ns_ = clocks_.monotonic_ns();
  if (!request_.open(path_.text(), std::span(lines_).first(line_count_), consumer_.text(), error_))
    return false;
  for (std::size_t i = 0; i < request_.descriptor_count(); ++i) {
    watches_[i] = loop_.watch(request_.descriptor(i), EPOLLIN, *this, static_cast<std::uint32_t>(i));
    if (!watches_[i]) {
      error_.set("%s: the event loop has no room for one more descriptor", chip_.text());
      release();
      return false;
    }
  }
  for (EdgeCheck& check : checks_) check.restart();
  was_full_ = {};
  ++counters_.opens;
  back_off_.reset();
  error_.clear();
  return true;
}

void GpioLines::on_ready(std::uint32_t, std::uint32_t epoll_events) {
  for (int round = 0; round < rounds_at_once; ++round) {
    // What waits on every line, merged: edges of different lines come in the order of their stamps.
    std::size_t count = 0;
    int error_number = 0;
    std::array<bool, GpioRequest::line_capacity> is_full{};
    const std::size_t share =
        GpioRequest::has_sequence_numbers() ? GpioRequest::read_capacity : GpioRequest::buffer_v1;
    for (std::size_t i = 0; i < request_.descriptor_count(); ++i) {
      const int received = request_.read(i, std::span(edges_).subspan(count, share));
      if (received < 0) {
        if (errno != EAGAIN && errno != EINTR) error_number = errno;
        continue;
      }
      count += static_cast<std::size_t>(received);
      is_full[i] =
          !GpioRequest::has_sequence_numbers() && received == static_cast<int>(GpioRequest::buffer_v1);
    }
    const std::int64_t now = clocks_.monotonic_ns();
    const auto batch = std::span(edges_).first(count);
    for (StampedEdge& stamped : batch) {
      stamped.stamp_ns = edge_stamp_ns(stamped.stamp_ns, now, bridge_, counters_.implausible_stamps);
    }
    // By insertion: short, nearly in order, and std::stable_sort takes memory from the heap.
    for (std::size_t i = 1; i < count; ++i) {
      for (std::size_t j = i; j > 0 && batch[j].stamp_ns < batch[j - 1].stamp_ns; --j)
        std::swap(batch[j], batch[j - 1]);
    }
    for (const StampedEdge& stamped : batch) deliver(stamped, now);
    for (std::size_t i = 0; i < is_full.size(); ++i) {
      // A buffer that was full has dropped what came after: after this batch, edges may be missing.
      if (!is_full[i]) continue;
      ++counters_.full_buffers;
      report_loss(static_cast<std::uint8_t>(i), 0, now);
      checks_[i].restart();
    }
    // Kernels differ in whether a chip that is gone shows in the read or in the poll.
    if (count == 0 && (epoll_events & (EPOLLERR | EPOLLHUP)) != 0) error_number = ENODEV;
    if (error_number != 0) {
      lose(now, error_number);
      return;
    }
    if (count == 0) return;
  }
}

void GpioLines::deliver(const StampedEdge& stamped, std::int64_t now_ns) {
  Event event;
  event.stamp_ns = stamped.stamp_ns;
  event.kind = EventKind::edge;
  event.edge = stamped.edge;
  if (stamped.edge.line >= line_count_) {
    ++counters_.implausible_stamps;
    return;
  }
  if (const auto missing = checks_[stamped.edge.line].missing_before(stamped.edge)) {
    report_loss(stamped.edge.line, *missing, std::min(stamped.stamp_ns, now_ns));
  }
  event.edge.line = static_cast<std::uint8_t>(event.edge.line + first_line_);
  ++counters_.edges;
  loop_.sink().on_event(event);
}

void GpioLines::report_loss(std::uint8_t line, std::uint32_t count, std::int64_t stamp_ns) {
  ++counters_.losses;
  counters_.edges_lost += count;
  if (loss_notice_.may(stamp_ns)) {
    loop_.raise(stamp_ns, Severity::warning, chip_.text(),
                "edges were lost before they were read, on line; a real-time priority or libgpiod 2 helps",
                line);
  }
  Event event;
  event.stamp_ns = stamp_ns;
  event.kind = EventKind::edges_lost;
  event.lost_count = count;
  event.edge.line = static_cast<std::uint8_t>(line + first_line_);
  loop_.sink().on_event(event);
}

void GpioLines::lose(std::int64_t now_ns, int error_number) {
  loop_.raise(now_ns, Severity::error, chip_.text(), "the GPIO chip is gone; trying to get its lines again",
              error_number);
  release();
  for (std::size_t i = 0; i < line_count_; ++i) report_loss(static_cast<std::uint8_t>(i), 0, now_ns);
  back_off_.failed(now_ns);
}

void GpioLines::on_tick(std::int64_t now_ns) {
  if (request_.is_open()) {
    // Kernels before 6.6 do not wake those who wait on a chip that is unplugged: its file is looked at.
    if (now_ns - looked_ns_ < look_every_ns) return;
    looked_ns_ = now_ns;
    if (file_of(path_.text()) != file_) lose(now_ns, ENODEV);
    return;
  }
  if (!back_off_.is_due(now_ns)) return;
  if (try_open()) {
    loop_.raise(now_ns, Severity::info, chip_.text(), "the GPIO lines are there");
  } else {
    back_off_.failed(now_ns);
  }
}

}  // namespace alces
