// One function a format: a file's bytes to points and their channels, InputError where they are not what the
// format promises.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scan_points.h"

namespace alces::offline {

/// What a .bin file is a row of.
struct BinaryRecord {
  std::size_t numbers = 4;  ///< of a point; the first three are x y z
  bool is_double = false;
  [[nodiscard]] std::size_t bytes() const { return numbers * (is_double ? 8 : 4); }
};

/// How the numbers of all files of one input become points.
struct ScanReading {
  double scale = 1;                    ///< to the format's own unit
  std::array<double, 3> origin_m{};    ///< taken off in double precision, before a float has to hold the rest
  std::optional<BinaryRecord> record;  ///< of .bin files; none: each file is recognised for itself

  [[nodiscard]] Point point(double x, double y, double z) const {
    return {static_cast<float>(x * scale - origin_m[0]), static_cast<float>(y * scale - origin_m[1]),
            static_cast<float>(z * scale - origin_m[2])};
  }
};

struct ScanBytes {
  const std::filesystem::path& file;  ///< for the errors
  std::string_view bytes;             ///< the whole file, a 0 behind its end
  std::vector<std::string>& warnings;
  ScanReading reading = {};
};

/// x y z in cm of 3DTK's frame a line, further columns ignored. A first line that is a # comment, a count,
/// "361 x 480" or words with one number at most is a header. 8 million points a second or more.
void parse_3dtk(const ScanBytes& scan, ScanPoints& out);

/// ascii, binary, binary_compressed; fields x y z of any type at any place.
void parse_pcd(const ScanBytes& scan, ScanPoints& out);

/// ascii, binary of either byte order; x y z of element vertex, everything else skipped.
void parse_ply(const ScanBytes& scan, ScanPoints& out);

/// LAS 1.0 to 1.4, point formats 0 to 10; the header's bounds are not used. LAZ is refused: Debian has no
/// library for it.
void parse_las(const ScanBytes& scan, ScanPoints& out);

/// Records without a header: float32 x y z intensity (KITTI) unless reading.record says otherwise.
void parse_kitti(const ScanBytes& scan, ScanPoints& out);
/// Four float32 (KITTI), or five (nuScenes: ... intensity ring) by what the numbers look like; a note in
/// `warnings` when it is not KITTI's. InputError, with the remedy, when it is neither.
[[nodiscard]] BinaryRecord recognise_record(const ScanBytes& scan);
/// "float32x5", "float64x3"; none: not of this form.
[[nodiscard]] std::optional<BinaryRecord> binary_record_called(std::string_view name);

/// Columns x y z by the names in the header (a comment counts, too), or the first three; separated by commas,
/// semicolons, tabs or blanks. Decimal commas where another separator stands between the columns. A lone
/// count above the points and a byte-order mark are passed over.
void parse_csv(const ScanBytes& scan, ScanPoints& out);

}  // namespace alces::offline
