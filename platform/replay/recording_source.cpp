#include "alces_platform/replay/recording_source.h"

#include <cstring>

namespace alces::replay {
namespace {

[[noreturn]] void fail_to_read(const std::string& name, int error_number) {
  throw TraceError(name + ": cannot be read on (" + std::strerror(error_number) +
                   "); what comes after is unknown, check the disk");
}

}  // namespace

RecordingSource::RecordingSource(const std::filesystem::path& file)
    : name_(file.string()), file_(name_.c_str()), reader_(file_) {
  if (!file_.is_open()) {
    std::string sentence = name_;
    sentence += ": cannot be opened (";
    sentence += std::strerror(file_.error_number());
    throw TraceError(sentence + ")");
  }
  const bool is_open = reader_.open();
  if (file_.error_number() != 0) fail_to_read(name_, file_.error_number());
  if (!is_open) throw TraceError(name_ + ": " + reader_.problems().front());
}

bool RecordingSource::next(Event& event) {
  if (reader_.next_event(event)) return true;
  if (file_.error_number() != 0) fail_to_read(name_, file_.error_number());
  return false;
}

TraceProblems RecordingSource::problems() const {
  TraceProblems problems;
  for (const std::string& sentence : reader_.problems()) problems.add(name_ + ": " + sentence);
  problems.count = reader_.problem_count();
  const auto count = [&](std::uint64_t messages, const char* what) {
    if (messages > 0) problems.add(name_ + ": " + std::to_string(messages) + what);
  };
  count(reader_.counters().messages_missing, " messages are missing, by the gaps in their numbers");
  count(reader_.counters().messages_malformed,
        " messages do not decode as their type says; they are passed over");
  return problems;
}

}  // namespace alces::replay
