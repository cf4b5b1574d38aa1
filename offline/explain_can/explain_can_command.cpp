// alces explain-can: a CAN trace in words, a line a frame, and what is worth a look at the end.
#include <fmt/core.h>

#include <array>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "candump_lines.h"
#include "explain_can.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* explain_can_footer = R"(Examples:
  alces explain-can candump.txt                       CANopen and CiA 402 by the standards' defaults
  alces explain-can candump.txt --dcf drive.dcf       with the device's own objects, types and PDO mapping
  alces explain-can candump.txt --dcf drive.eds --node 3 --json

Traces: candump's text, from the screen (with or without times) or from a log (-l, -L). Lines worth a look are
marked with '!' and repeated in the summary: refusals, emergencies, faults, restarts, bus errors. An emergency that comes
again within ten seconds is counted in the summary and not printed.)";

constexpr std::size_t most_listed = 50;
constexpr double fold_s = 10;  ///< an emergency that comes again within this is counted, not printed ...
constexpr std::size_t fold_lines = 1000;  ///< ... or within so many lines, where a trace has no times

struct ExplainCanOptions {
  std::string trace;
  std::string dcf;
  std::optional<int> node;
  bool json = false;
};

/// One kind of abnormal frame, however often it came.
struct Abnormal {
  std::size_t line = 0;  ///< the first
  std::size_t last_line = 0;
  std::size_t times = 0;
  std::string text;
};

struct Summary {
  std::size_t frames = 0;
  std::array<std::size_t, can_frame_meaning_count> by_meaning{};
  std::map<std::string, std::size_t> unknown_ids;
  std::vector<Abnormal> abnormal;
  std::map<std::string, std::size_t> abnormal_places;  ///< in `abnormal`, by text
  std::size_t abnormal_count = 0;
  std::size_t abnormal_unlisted = 0;
  std::vector<std::string> open;

  void add_abnormal(std::size_t line, const std::string& text) {
    ++abnormal_count;
    const auto known = abnormal_places.find(text);
    if (known == abnormal_places.end() && abnormal.size() == most_listed) {
      ++abnormal_unlisted;
      return;
    }
    const std::size_t place = known == abnormal_places.end() ? abnormal.size() : known->second;
    if (known == abnormal_places.end()) {
      abnormal_places.emplace(text, place);
      abnormal.push_back({line, line, 0, text});
    }
    ++abnormal[place].times;
    abnormal[place].last_line = line;
  }
};

/// A drive in trouble may send its emergencies by the thousand: each is printed once, and again when it was
/// away for a while.
class EmergencyFolds {
 public:
  /// False: it was counted. Else how often it had come meanwhile is behind `folded_before`.
  bool is_to_print(const CandumpLine& line, const std::string& text, std::size_t& folded_before) {
    Fold& fold = folds_[line.channel + " " + text];
    const bool is_again =
        fold.last_line != 0 && (line.stamp_s && fold.last_s ? *line.stamp_s - *fold.last_s < fold_s
                                                            : line.line - fold.last_line < fold_lines);
    fold.last_line = line.line;
    fold.last_s = line.stamp_s;
    if (is_again) {
      ++fold.folded;
      return false;
    }
    folded_before = std::exchange(fold.folded, 0);
    return true;
  }

 private:
  struct Fold {
    std::size_t last_line = 0;
    std::optional<double> last_s;
    std::size_t folded = 0;
  };
  std::map<std::string, Fold> folds_;
};

Json json_of(const CandumpLine& line, const CanExplanation& explanation) {
  Json json;
  json["line"] = line.line;
  if (line.stamp_s) json["stamp_s"] = *line.stamp_s;
  json["channel"] = line.channel;
  json["frame"] = candump_text(line.frame);
  json["kind"] = to_string(explanation.meaning);
  if (explanation.node != 0) json["node"] = explanation.node;
  json["abnormal"] = explanation.is_abnormal;
  json["text"] = explanation.text;
  return json;
}

Json json_of(const Summary& summary) {
  Json json;
  json["frames"] = summary.frames;
  Json& kinds = json["frames_by_kind"] = Json::object();
  for (std::size_t i = 0; i < can_frame_meaning_count; ++i) {
    if (summary.by_meaning[i] > 0) kinds[to_string(static_cast<CanFrameMeaning>(i))] = summary.by_meaning[i];
  }
  json["unknown_ids"] = summary.unknown_ids;
  json["abnormal_frames"] = summary.abnormal_count;
  Json& abnormal = json["abnormal"] = Json::array();
  for (const Abnormal& each : summary.abnormal)
    abnormal.push_back(
        {{"line", each.line}, {"text", each.text}, {"times", each.times}, {"last_line", each.last_line}});
  json["open"] = summary.open;
  return json;
}

void print(const Summary& summary) {
  fmt::print("\n{} frames:", summary.frames);
  const char* separator = " ";
  for (std::size_t i = 0; i < can_frame_meaning_count; ++i) {
    if (summary.by_meaning[i] == 0) continue;
    fmt::print("{}{} {}", separator, summary.by_meaning[i], to_string(static_cast<CanFrameMeaning>(i)));
    separator = ", ";
  }
  fmt::print("\n");
  for (const auto& [id, count] : summary.unknown_ids)
    fmt::print("unknown identifier {}: {} frames\n", id, count);
  if (summary.abnormal_count == 0 && summary.open.empty()) {
    fmt::print("nothing abnormal\n");
    return;
  }
  if (summary.abnormal_count > 0) fmt::print("worth a look ({} frames):\n", summary.abnormal_count);
  for (const Abnormal& each : summary.abnormal) {
    fmt::print("  line {}: {}", each.line, each.text);
    if (each.times > 1) fmt::print(" ({} times, the last in line {})", each.times, each.last_line);
    fmt::print("\n");
  }
  if (summary.abnormal_unlisted > 0)
    fmt::print("  and {} more, marked '!' above\n", summary.abnormal_unlisted);
  for (const std::string& what : summary.open) fmt::print("at the end: {}\n", what);
}

void explain(const ExplainCanOptions& options) {
  std::shared_ptr<const ObjectDictionaryFile> dictionary;
  std::optional<std::uint8_t> node;
  if (!options.dcf.empty()) {
    try {
      dictionary = std::make_shared<const ObjectDictionaryFile>(ObjectDictionaryFile::read(options.dcf));
    } catch (const DictionaryError& error) {
      throw InputError(error.what());
    }
    for (const std::string& warning : dictionary->warnings()) fmt::print(stderr, "alces: {}\n", warning);
    if (options.node) node = static_cast<std::uint8_t>(*options.node);
  } else if (options.node) {
    throw UsageError("--node says which node --dcf describes; there is no --dcf");
  }
  std::map<std::string, CanExplainer> buses;
  Summary summary;
  EmergencyFolds folds;
  const CandumpRead read = read_candump(options.trace, [&](const CandumpLine& line) {
    CanExplainer& bus = buses.try_emplace(line.channel, dictionary, node).first->second;
    const CanExplanation explanation = bus.explain(line.frame);
    ++summary.frames;
    ++summary.by_meaning[static_cast<std::size_t>(explanation.meaning)];
    if (explanation.meaning == CanFrameMeaning::unknown)
      ++summary.unknown_ids[fmt::format("0x{:03X}", line.frame.id)];
    if (explanation.is_abnormal) summary.add_abnormal(line.line, explanation.text);
    if (options.json) {
      fmt::print("{}\n", json_text(json_of(line, explanation), -1));
      return;
    }
    std::size_t folded = 0;
    if (explanation.meaning == CanFrameMeaning::emergency &&
        !folds.is_to_print(line, explanation.text, folded))
      return;
    const std::string stamp = line.stamp_s ? fmt::format("{:.6f}  ", *line.stamp_s) : "";
    const std::string channel = buses.size() > 1 ? line.channel + "  " : "";
    fmt::print("{}{}{:<20} {} {}{}\n", stamp, channel, candump_text(line.frame),
               explanation.is_abnormal ? '!' : ' ', explanation.text,
               folded > 0 ? fmt::format(" (and {} times since it was printed last)", folded) : "");
  });
  std::fflush(stdout);
  for (const std::string& sentence : read.passed_over.sentences) fmt::print(stderr, "alces: {}\n", sentence);
  if (const std::uint64_t more = read.passed_over.count - read.passed_over.sentences.size(); more > 0)
    fmt::print(stderr, "alces: {} more lines are no frames\n", more);
  for (const auto& [channel, bus] : buses) {
    for (const std::string& matter : bus.open_matters()) {
      summary.open.push_back(buses.size() > 1 ? channel + ": " + matter : matter);
    }
  }
  if (options.json) {
    Json last = {{"summary", json_of(summary)}};
    last["summary"]["lines_passed_over"] = read.passed_over.count;
    fmt::print("{}\n", json_text(last, -1));
  } else {
    print(summary);
  }
}

}  // namespace

void add_explain_can_command(CLI::App& alces) {
  auto options = std::make_shared<ExplainCanOptions>();
  CLI::App* verb = alces.add_subcommand("explain-can", "A CAN trace in words: CANopen, drives, bus errors.");
  verb->footer(explain_can_footer);
  verb->add_option("TRACE", options->trace, "candump's text")->required();
  verb->add_option("--dcf", options->dcf, "EDS or DCF file of the device");
  verb->add_option("--node", options->node,
                   "the node that it describes (default: its NodeID, else every node)")
      ->check(CLI::Range(1, 127));
  verb->add_flag("--json", options->json, "a JSON object a line, the summary last");
  verb->callback([options] { explain(*options); });
}

}  // namespace alces::offline
