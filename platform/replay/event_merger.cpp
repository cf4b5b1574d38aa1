#include "alces_platform/replay/event_merger.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "alces_drivers/stamp.h"

namespace alces::replay {

void EventMerger::add(std::unique_ptr<EventSource> source, std::int64_t offset_ns) {
  Source& added = sources_.emplace_back();
  added.source = std::move(source);
  added.offset_ns = offset_ns;
}

void EventMerger::fetch(Source& source) {
  source.has_event = source.source->next(source.event);
  if (!source.has_event) return;
  // So that differences and sums of a few do not overflow.
  const auto sane = [](std::int64_t stamp_ns) {
    return std::clamp(stamp_ns, -latest_stamp_ns, latest_stamp_ns);
  };
  if (source.event.stamp_ns != sane(source.event.stamp_ns))
    problems_.add(source.source->name() + ": a stamp beyond 73 years is taken for the farthest that can be");
  source.event.stamp_ns = sane(source.event.stamp_ns);
  if (source.is_first && options_.align_starts) source.offset_ns = -source.event.stamp_ns;
  source.event.stamp_ns = sane(source.event.stamp_ns + source.offset_ns);
  if (!source.is_first) {
    const std::int64_t step_ns = source.event.stamp_ns - source.due_ns;
    if (step_ns > options_.longest_gap_ns || step_ns < -options_.longest_fall_back_ns)
      take_out_step(source, step_ns);
  }
  source.due_ns = source.is_first ? source.event.stamp_ns : std::max(source.due_ns, source.event.stamp_ns);
  source.is_first = false;
}

/// The event comes at once behind the one before, or, where another source had the same step, by that one's.
void EventMerger::take_out_step(Source& source, std::int64_t step_ns) {
  constexpr std::int64_t same_step_ns = 10 * ns_per_s;
  bool is_known = false;
  for (const std::int64_t known_ns : steps_ns_) {
    if (std::abs(known_ns - step_ns) > same_step_ns) continue;
    step_ns = known_ns;
    is_known = true;
    break;
  }
  if (!is_known) steps_ns_.push_back(step_ns);
  source.offset_ns -= step_ns;
  source.event.stamp_ns -= step_ns;
  std::string sentence = source.source->name();
  sentence += ": its clock was set ";
  sentence += std::to_string(std::abs(step_ns) / ns_per_s);
  sentence += step_ns > 0 ? " s forward" : " s back";
  problems_.add(sentence + " within the trace; what follows is taken as going on at once");
}

bool EventMerger::next(Event& event) {
  if (!has_begun_) {
    for (Source& source : sources_) fetch(source);
  } else if (handed_on_ != nullptr) {
    fetch(*handed_on_);
  }
  handed_on_ = nullptr;

  Source* first = nullptr;
  for (Source& source : sources_) {
    if (source.has_event && (first == nullptr || source.due_ns < first->due_ns)) first = &source;
  }
  if (first == nullptr) return false;
  if (!has_begun_) {
    has_begun_ = true;
    now_ns_ = first->due_ns;
    next_tick_ns_ = now_ns_;
  }
  if (first->due_ns - now_ns_ > options_.longest_gap_ns) {
    std::string sentence = first->source->name();
    sentence += ": goes on ";
    sentence += std::to_string((first->due_ns - now_ns_) / ns_per_s);
    sentence += " s after everything else (" + last_name_;
    sentence += "); when their clocks differ, give the offset, or let all begin at the same time";
    throw TraceError(sentence);
  }
  if (options_.tick_interval_ns > 0 && next_tick_ns_ <= first->due_ns) {
    event = {};
    event.stamp_ns = now_ns_ = next_tick_ns_;
    next_tick_ns_ += options_.tick_interval_ns;
    return true;
  }
  event = first->event;
  now_ns_ = first->due_ns;
  last_name_ = first->source->name();
  handed_on_ = first;
  return true;
}

std::string EventMerger::name() const {
  std::string names;
  for (const Source& source : sources_) {
    if (!names.empty()) names += ", ";
    names += source.source->name();
  }
  return names;
}

TraceProblems EventMerger::problems() const {
  TraceProblems problems = problems_;
  for (const Source& source : sources_) problems.add(source.source->problems());
  return problems;
}

std::uint64_t EventMerger::bytes_read() const {
  std::uint64_t bytes = 0;
  for (const Source& source : sources_) bytes += source.source->bytes_read();
  return bytes;
}

}  // namespace alces::replay
