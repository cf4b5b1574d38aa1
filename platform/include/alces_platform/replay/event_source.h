// Events from somewhere, one after the other: a trace, a recording, several of them merged.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces_drivers/scanner/event.h"

namespace alces::replay {

/// A trace that cannot be read at all: one sentence that names the file, the line, and what to do.
class TraceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A trace that cannot be written.
class TraceWriteError : public TraceError {
 public:
  using TraceError::TraceError;
};

/// What was passed over. The sentences name file and line; the first most_sentences of `count`.
struct TraceProblems {
  static constexpr std::size_t most_sentences = 20;

  std::uint64_t count = 0;
  std::vector<std::string> sentences;

  void add(const std::string& sentence) {
    ++count;
    if (sentences.size() < most_sentences) sentences.push_back(sentence);
  }
  void add(const TraceProblems& others) {
    count += others.count;
    for (const std::string& sentence : others.sentences) {
      if (sentences.size() < most_sentences) sentences.push_back(sentence);
    }
  }
};

class EventSource {
 public:
  EventSource() = default;
  EventSource(const EventSource&) = delete;
  EventSource& operator=(const EventSource&) = delete;
  virtual ~EventSource() = default;

  /// False: no more. The event's bytes are valid until the next call. TraceError.
  [[nodiscard]] virtual bool next(Event& event) = 0;
  /// For people: the file's name.
  [[nodiscard]] virtual std::string name() const = 0;
  /// Up to now.
  [[nodiscard]] virtual TraceProblems problems() const = 0;
  /// Of its files, for a progress bar.
  [[nodiscard]] virtual std::uint64_t bytes_read() const = 0;
};

}  // namespace alces::replay
