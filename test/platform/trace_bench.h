// Traces in a folder of their own, for tests.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "alces_platform/replay/event_source.h"
#include "recording/sample_drive.h"

namespace alces::replay {

class TraceBench {
 public:
  TraceBench() {
    std::string name = (std::filesystem::temp_directory_path() / "alces_traces_XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) folder = name;
  }
  TraceBench(const TraceBench&) = delete;
  TraceBench& operator=(const TraceBench&) = delete;
  ~TraceBench() {
    std::error_code ignored;
    if (!folder.empty()) std::filesystem::remove_all(folder, ignored);
  }

  std::filesystem::path write(std::string_view name, std::string_view content) const {
    std::ofstream(folder / name, std::ios::binary) << content;
    return folder / name;
  }

  std::filesystem::path folder;
};

inline std::string content_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

inline std::vector<sample::OwnedEvent> all_events(EventSource& source) {
  std::vector<sample::OwnedEvent> events;
  Event event;
  while (source.next(event)) {
    sample::OwnedEvent& owned = events.emplace_back();
    owned.bytes.assign(event.bytes.begin(), event.bytes.end());
    owned.event = event;
  }
  for (sample::OwnedEvent& owned : events) owned.event.bytes = owned.bytes;
  return events;
}

}  // namespace alces::replay
