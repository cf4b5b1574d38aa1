// Events of the simulated world that the host has not been told of yet, in the order in which it will be.
#pragma once

#include <algorithm>
#include <cstdint>
#include <queue>
#include <utility>
#include <vector>

#include "alces_drivers/scanner/event.h"

namespace alces::sim {

class EventQueue {
 public:
  /// `due_ns`: when the host hears of it; the event's own stamp is usually a little earlier. Of equally due
  /// events the first pushed comes first. `bytes` become the event's.
  void push(std::int64_t due_ns, const Event& event, std::vector<std::uint8_t> bytes = {}) {
    queue_.push({due_ns, order_++, event, std::move(bytes)});
  }

  /// When the next event is due; INT64_MAX: there is none.
  [[nodiscard]] std::int64_t next_due_ns() const { return queue_.empty() ? INT64_MAX : queue_.top().due_ns; }

  /// Hands on what is due up to `until_ns`; `now_ns` is set to each event's due time before.
  void deliver(std::int64_t until_ns, std::int64_t& now_ns, EventSink& sink) {
    while (!queue_.empty() && queue_.top().due_ns <= until_ns) {
      Item item = std::move(const_cast<Item&>(queue_.top()));  // popped at once: its order is not asked again
      queue_.pop();
      item.event.bytes = item.bytes;
      now_ns = std::max(now_ns, item.due_ns);
      sink.on_event(item.event);
    }
  }

 private:
  struct Item {
    std::int64_t due_ns = 0;
    std::uint64_t order = 0;
    Event event;
    std::vector<std::uint8_t> bytes;
    friend bool operator<(const Item& a, const Item& b) {
      return a.due_ns != b.due_ns ? a.due_ns > b.due_ns : a.order > b.order;  // the earliest on top
    }
  };
  std::priority_queue<Item> queue_;
  std::uint64_t order_ = 0;
};

}  // namespace alces::sim
