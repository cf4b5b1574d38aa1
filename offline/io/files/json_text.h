// JSON as text, whatever bytes its strings have: names of files need not be UTF-8.
#pragma once

#include <string>

namespace alces::offline {

/// Indented by `indent` blanks, on one line with -1. Bytes that are no UTF-8 become U+FFFD.
template <typename Json>
[[nodiscard]] std::string json_text(const Json& json, int indent = 2) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace alces::offline
