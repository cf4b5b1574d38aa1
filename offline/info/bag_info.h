// What `alces info` says of a bag: its topics, and which of them would make a map, and why.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/io/scans/scan_source.h"

namespace alces::offline {

/// InputError.
[[nodiscard]] nlohmann::ordered_json describe_bag(
    const std::filesystem::path& bag, const BagTopics& asked,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The same for people, with the topics as a table.
[[nodiscard]] std::string bag_text(const nlohmann::ordered_json& description);

}  // namespace alces::offline
