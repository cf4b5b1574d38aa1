// Several sources as one, in time order: of equal stamps the earlier source first, within a source always its
// own order. Ticks come in between, every tick_interval_ns of the traces' time, as an event loop would make
// them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "alces_platform/replay/event_source.h"

namespace alces::replay {

struct EventMergerOptions {
  std::int64_t tick_interval_ns = 10'000'000;  ///< 0: no ticks
  /// A longer time without an event is taken for clocks that do not fit each other: TraceError. Within one
  /// source it is a clock that was set (as by NTP, once the network is there): the step is taken out of the
  /// stamps that follow, and told.
  std::int64_t longest_gap_ns = 24 * 3600 * std::int64_t{1'000'000'000};
  bool align_starts = false;  ///< each source's first event comes at time 0: for clocks that nobody related
  /// Stamps of one source that fall back further are such a step, too.
  std::int64_t longest_fall_back_ns = 1'000'000'000;
};

class EventMerger final : public EventSource {
 public:
  explicit EventMerger(const EventMergerOptions& options = {}) : options_(options) {}

  /// offset_ns is added to its stamps.
  void add(std::unique_ptr<EventSource> source, std::int64_t offset_ns = 0);

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override;
  [[nodiscard]] TraceProblems problems() const override;
  [[nodiscard]] std::uint64_t bytes_read() const override;

 private:
  struct Source {
    std::unique_ptr<EventSource> source;
    std::int64_t offset_ns = 0;
    Event event;
    std::int64_t due_ns = 0;  ///< the largest stamp of it so far: its events do not overtake each other
    bool has_event = false;
    bool is_first = true;
  };
  void fetch(Source& source);
  void take_out_step(Source& source, std::int64_t step_ns);

  EventMergerOptions options_;
  std::vector<Source> sources_;
  Source* handed_on_ = nullptr;  ///< its next event is fetched when this one is done with
  std::string last_name_;
  std::vector<std::int64_t> steps_ns_;  ///< of clocks that were set; other sources have the same
  TraceProblems problems_;
  std::int64_t now_ns_ = 0;
  std::int64_t next_tick_ns_ = 0;
  bool has_begun_ = false;
};

}  // namespace alces::replay
