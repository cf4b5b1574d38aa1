// Statistics as the programs' JSON has them.
#pragma once

#include <nlohmann/json.hpp>

#include "offline/evaluate/evaluation.h"

namespace alces::offline {

[[nodiscard]] inline nlohmann::json to_json(const Statistics& statistics) {
  return {{"count", statistics.count},
          {"mean", statistics.mean},
          {"standard_deviation", statistics.standard_deviation},
          {"median", statistics.median},
          {"rmse", statistics.rmse},
          {"max", statistics.max}};
}

}  // namespace alces::offline
