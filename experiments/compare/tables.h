// The paper's Tables 1 and 2 of an experiment, for people (Markdown), spreadsheets (CSV) and scripts (JSON).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "experiment.h"

namespace alces::offline {

/// What was compared, for the heads of the tables.
struct ExperimentFacts {
  std::string source;  ///< "924 scans, PCD, ..."
  std::string truth;   ///< file; empty: none
  std::string front_end;
  nlohmann::json settings;  ///< the mapper's
  std::string version;
  std::vector<std::string> command_line;
  std::string circular = {};  ///< why the truth says nothing of the maps; empty: nothing is known against it
};

/// Errors or consistency, run times, and what the columns are.
[[nodiscard]] std::string markdown_tables(const ExperimentResult& result, const ExperimentFacts& facts);
/// One line a row, all figures.
[[nodiscard]] std::string csv_table(const ExperimentResult& result);
[[nodiscard]] nlohmann::json experiment_json(const ExperimentResult& result, const ExperimentFacts& facts);

/// tables.md, tables.csv, compare.json; each whole or not at all. OutputError.
void write_tables(const std::filesystem::path& out, const ExperimentResult& result,
                  const ExperimentFacts& facts);

}  // namespace alces::offline
