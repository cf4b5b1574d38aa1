// The files of a folder in the order that its events.txt gives.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::replay {

class OrderedSource final : public EventSource {
 public:
  explicit OrderedSource(const std::filesystem::path& order);
  /// `what`: how events.txt calls it ("can0", "edge", "laser_a.sent").
  void add(const std::string& what, std::unique_ptr<EventSource> source);

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return order_.name(); }
  [[nodiscard]] TraceProblems problems() const override;
  [[nodiscard]] std::uint64_t bytes_read() const override;

 private:
  [[nodiscard]] bool read_entry(Words& words, std::int64_t stamp_ns, Event& event);
  [[noreturn]] void refuse(const std::string& what) const;
  void end();

  LineReader order_;
  std::map<std::string, std::unique_ptr<EventSource>> sources_;
  bool ended_ = false;
  TraceProblems problems_;
};

}  // namespace alces::replay
