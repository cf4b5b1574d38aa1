// Whole files into memory, and what else is asked of a file before it is parsed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace alces::offline {

/// Replaces `bytes`; its memory is used again from file to file. InputError.
void read_file(const std::filesystem::path& file, std::string& bytes);

/// A read that failed was no end: InputError where error_number is not 0.
void check_read(const std::filesystem::path& file, int error_number);

/// The files of a folder (no folders), in natural order; InputError when it cannot be listed.
[[nodiscard]] std::vector<std::filesystem::path> list_files(const std::filesystem::path& folder);

/// scan9 before scan10: runs of digits compare as numbers; 7.103417 before 7.2: behind a number and a point
/// they are decimals.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

/// The last run of digits in a file's name without extension: 7 of scan007.3d; of more than 64 bits the
/// largest that there is. None where they are the decimals of a number.
[[nodiscard]] std::optional<std::uint64_t> number_in_name(const std::filesystem::path& file);

/// The stamp in a file's name, in seconds: a number with decimals (17.25.pcd), or since 1970 in s, ms, us or
/// ns, which its digits tell from a number of a scan.
[[nodiscard]] std::optional<double> stamp_in_name(const std::filesystem::path& file);

/// 64 bits (FNV-1a) that tell one content from another, as 16 hexadecimal digits. No protection against
/// anybody.
class ContentDigest {
 public:
  void add(std::string_view bytes);
  [[nodiscard]] std::string text() const;

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

/// What a scan may be numbered at most: map.ply has 32 bits for it. A trajectory, whose numbers go through a
/// double, is exact far beyond.
inline constexpr std::uint64_t largest_scan_number = UINT32_MAX;

}  // namespace alces::offline
