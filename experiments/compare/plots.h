// The paper's figures of an experiment, drawn by gnuplot: data files, a script beside them that may be
// changed and run again, and from it SVG and PNG.
//
// OUT/plots/data/*.dat hold the numbers (columns are named in their first line), OUT/plots/style.gp colours
// and fonts, OUT/plots/NAME.gp one figure each; `cd OUT/plots && gnuplot NAME.gp` draws it again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "experiment.h"

namespace alces::offline {

struct PlotReport {
  std::vector<std::filesystem::path> pictures;
  std::vector<std::string> left_out;  ///< a sentence for each figure without data
  std::string problem;  ///< a sentence when gnuplot is missing or fails; the scripts are there all the same
};

/// Writes scripts and data (OutputError) and draws what the experiment has data for:
///   trajectories       over ground truth (Figures 10, 12, 19), without it beside each other
///   error-by-scan      online rows (Figure 13) and, -post, those with post-processing (Figure 14)
///   convergence-SCAN   of each watched scan (Figures 15, 16)
///   run-time           bars, online and post-processing (Figure 17), where a strategy took any time besides
///   ICP error-by-loops     mean error over the drive, with the loops as dots
PlotReport write_plots(const std::filesystem::path& out, const ExperimentResult& result,
                       const ExperimentRequest& request, const std::string& gnuplot = "gnuplot");

}  // namespace alces::offline
