// A text file of numbers, row by row: what all trajectory formats have in common.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace alces::offline {

class NumberTable {
 public:
  /// Rows as the lines that hold numbers, separated by blanks, tabs, commas or semicolons; # and % start
  /// comments. Above the first row a line of names may stand, and commas are decimal points where semicolons
  /// stand between the numbers. InputError where something else stands.
  [[nodiscard]] static NumberTable read(const std::filesystem::path& file);

  [[nodiscard]] std::size_t rows() const { return lines_.size(); }
  [[nodiscard]] std::span<const double> row(std::size_t index) const {
    return std::span(numbers_).subspan(begins_[index], begins_[index + 1] - begins_[index]);
  }
  /// In the file, from 1.
  [[nodiscard]] std::size_t line(std::size_t index) const { return lines_[index]; }
  [[nodiscard]] std::span<const double> numbers() const { return numbers_; }
  /// The cells of the comments and of the line of names above the first row, a list a line: what the columns
  /// may be called.
  [[nodiscard]] const std::vector<std::vector<std::string>>& headings() const { return headings_; }

 private:
  [[nodiscard]] bool take_heading(std::string_view line);

  std::vector<std::vector<std::string>> headings_;
  std::vector<double> numbers_;
  std::vector<std::size_t> begins_ = {0};
  std::vector<std::size_t> lines_;
};

}  // namespace alces::offline
