// --topic, --frame and --tf: what is taken of a bag, for every verb that reads scans.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "offline/io/scans/scan_source.h"

namespace alces::offline {

void add_bag_options(CLI::App& verb, BagTopics& bag);

/// As run.json keeps it, so that others read the same scans.
[[nodiscard]] nlohmann::json to_json(const BagTopics& bag);
[[nodiscard]] BagTopics bag_topics_from(const nlohmann::json& reading);

}  // namespace alces::offline
