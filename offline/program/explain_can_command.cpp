// alces explain-can: a CAN trace in words, a line a frame, and what is worth a look at the end.
#include <fmt/core.h>

#include <array>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "alces_offline/candump_lines.h"
#include "alces_offline/error.h"
#include "alces_offline/explain_can.h"
#include "alces_offline/json_text.h"
#include "command.h"

namespace alces::offline {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* footer = R"(Examples:
  alces explain-can candump.txt                       CANopen and CiA 402 by the standards' defaults
  alces explain-can candump.txt --dcf drive.dcf       with the device's own objects, types and PDO mapping
  alces explain-can candump.txt --dcf drive.eds --node 3 --json

Traces: candump's text, from the screen (with or without times) or from a log (-l, -L). Lines worth a look are
marked with '!' and repeated in the summary: refusals, emergencies, faults, restarts, bus errors.)";

constexpr std::size_t most_listed = 50;

struct Options {
  std::string trace;
  std::string dcf;
  std::optional<int> node;
  bool json = false;
};

struct Summary {
  std::size_t frames = 0;
  std::array<std::size_t, can_frame_meaning_count> by_meaning{};
  std::map<std::string, std::size_t> unknown_ids;
  std::vector<std::pair<std::size_t, std::string>> abnormal;  ///< line, text
  std::size_t abnormal_count = 0;
  std::vector<std::string> open;
};

Json json_of(const CandumpLine& line, const CanExplanation& explanation) {
  Json json;
  json["line"] = line.line;
  if (line.stamp_s) json["stamp_s"] = *line.stamp_s;
  json["channel"] = line.channel;
  json["frame"] = candump_text(line.frame);
  json["kind"] = text(explanation.meaning);
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
    if (summary.by_meaning[i] > 0) kinds[text(static_cast<CanFrameMeaning>(i))] = summary.by_meaning[i];
  }
  json["unknown_ids"] = summary.unknown_ids;
  json["abnormal_frames"] = summary.abnormal_count;
  Json& abnormal = json["abnormal"] = Json::array();
  for (const auto& [line, what] : summary.abnormal) abnormal.push_back({{"line", line}, {"text", what}});
  json["open"] = summary.open;
  return json;
}

void print(const Summary& summary) {
  fmt::print("\n{} frames:", summary.frames);
  const char* separator = " ";
  for (std::size_t i = 0; i < can_frame_meaning_count; ++i) {
    if (summary.by_meaning[i] == 0) continue;
    fmt::print("{}{} {}", separator, summary.by_meaning[i], text(static_cast<CanFrameMeaning>(i)));
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
  for (const auto& [line, what] : summary.abnormal) fmt::print("  line {}: {}\n", line, what);
  if (summary.abnormal_count > summary.abnormal.size()) {
    fmt::print("  and {} more, marked '!' above\n", summary.abnormal_count - summary.abnormal.size());
  }
  for (const std::string& what : summary.open) fmt::print("at the end: {}\n", what);
}

void explain(const Options& options) {
  std::shared_ptr<const ObjectDictionaryFile> dictionary;
  std::optional<std::uint8_t> node;
  if (!options.dcf.empty()) {
    dictionary = std::make_shared<const ObjectDictionaryFile>(ObjectDictionaryFile::read(options.dcf));
    for (const std::string& warning : dictionary->warnings()) fmt::print(stderr, "alces: {}\n", warning);
    if (options.node) node = static_cast<std::uint8_t>(*options.node);
  } else if (options.node) {
    throw UsageError("--node says which node --dcf describes; there is no --dcf");
  }
  std::map<std::string, CanExplainer> buses;
  Summary summary;
  const CandumpRead read = read_candump(options.trace, [&](const CandumpLine& line) {
    CanExplainer& bus = buses.try_emplace(line.channel, dictionary, node).first->second;
    const CanExplanation explanation = bus.explain(line.frame);
    ++summary.frames;
    ++summary.by_meaning[static_cast<std::size_t>(explanation.meaning)];
    if (explanation.meaning == CanFrameMeaning::unknown)
      ++summary.unknown_ids[fmt::format("0x{:03X}", line.frame.id)];
    if (explanation.is_abnormal && summary.abnormal_count++ < most_listed) {
      summary.abnormal.emplace_back(line.line, explanation.text);
    }
    if (options.json) {
      fmt::print("{}\n", json_text(json_of(line, explanation), -1));
      return;
    }
    const std::string stamp = line.stamp_s ? fmt::format("{:.6f}  ", *line.stamp_s) : "";
    const std::string channel = buses.size() > 1 ? line.channel + "  " : "";
    fmt::print("{}{}{:<20} {} {}\n", stamp, channel, candump_text(line.frame),
               explanation.is_abnormal ? '!' : ' ', explanation.text);
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
  auto options = std::make_shared<Options>();
  CLI::App* verb = alces.add_subcommand("explain-can", "A CAN trace in words: CANopen, drives, bus errors.");
  verb->footer(footer);
  verb->add_option("TRACE", options->trace, "candump's text")->required();
  verb->add_option("--dcf", options->dcf, "EDS or DCF file of the device");
  verb->add_option("--node", options->node,
                   "the node that it describes (default: its NodeID, else every node)")
      ->check(CLI::Range(1, 127));
  verb->add_flag("--json", options->json, "a JSON object a line, the summary last");
  verb->callback([options] { explain(*options); });
}

}  // namespace alces::offline
