// gnuplot as another program: one script, one picture.
#pragma once

#include <filesystem>
#include <string>

namespace alces::offline {

enum class PictureFormat { svg, png };

/// Runs `gnuplot -e format='png' SCRIPT` in `folder`. Empty, or a sentence that says what went wrong.
[[nodiscard]] std::string draw(const std::string& gnuplot, const std::filesystem::path& folder,
                               const std::string& script, PictureFormat format);

}  // namespace alces::offline
