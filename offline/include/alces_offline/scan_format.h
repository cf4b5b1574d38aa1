// One function a format: a file's bytes to points, InputError where they are not what the format promises.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alces/point.h"

namespace alces::offline {

struct ScanBytes {
  const std::filesystem::path& file;  ///< for the errors
  std::string_view bytes;             ///< the whole file, a 0 behind its end
  std::vector<std::string>& warnings;
};

/// x y z in cm of 3DTK's frame a line, further columns ignored. A first line that is a # comment, a count,
/// "361 x 480" or words with one number at most is a header. 8 million points a second or more.
void parse_3dtk(const ScanBytes& scan, std::vector<Point>& points);

/// ascii, binary, binary_compressed; fields x y z of any type at any place.
void parse_pcd(const ScanBytes& scan, std::vector<Point>& points);

/// ascii, binary of either byte order; x y z of element vertex, everything else skipped.
void parse_ply(const ScanBytes& scan, std::vector<Point>& points);

/// LAS 1.0 to 1.4, point formats 0 to 10. Clouds in a national grid are moved by whole kilometres, with a
/// warning that says by which. LAZ is refused: Debian has no library for it.
void parse_las(const ScanBytes& scan, std::vector<Point>& points);

/// float32 x y z intensity.
void parse_kitti(const ScanBytes& scan, std::vector<Point>& points);

/// Columns x y z by the names in the header, or the first three; separated by commas, semicolons, tabs or
/// blanks.
void parse_csv(const ScanBytes& scan, std::vector<Point>& points);

}  // namespace alces::offline
