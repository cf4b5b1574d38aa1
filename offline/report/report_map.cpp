#include "report_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include "even_choice.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/text_numbers.h"
#include "offline/io/map_folder/ply_stream.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

void require(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored))
    throw InputError(file, "is missing; a report is of a folder that alces map or alces replay wrote");
}

nlohmann::json read_run(const fs::path& file, std::size_t scan_count) {
  require(file);
  std::string bytes;
  read_file(file, bytes);
  nlohmann::json run = nlohmann::json::parse(bytes, nullptr, false);
  if (!run.is_object()) throw InputError(file, "is no JSON object; map the scans again");
  nlohmann::json& loops = run["loops"];
  if (loops.is_null()) loops = nlohmann::json::array();
  if (!loops.is_array()) throw InputError(file, "\"loops\" is no list; map the scans again");
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const nlohmann::json& loop = loops[i];
    for (const char* key : {"first", "last"}) {
      if (!loop.is_object() || !loop.contains(key) || !loop[key].is_number_unsigned() ||
          loop[key].get<std::size_t>() >= scan_count)
        throw InputError(file, fmt::format("loop {} names no scan below {} as \"{}\"", i, scan_count, key));
    }
    if (!loop.contains("first_from_last_before")) continue;
    const nlohmann::json& before = loop["first_from_last_before"];
    if (!before.is_array() || before.size() != 7 ||
        !std::all_of(before.begin(), before.end(), [](const auto& number) { return number.is_number(); }))
      throw InputError(file, fmt::format("\"first_from_last_before\" of loop {} is not seven numbers", i));
  }
  return run;
}

CounterHistory read_counters(const fs::path& file) {
  std::string bytes;
  read_file(file, bytes);
  CounterHistory history;
  std::size_t line_number = 0;
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    const std::string line = bytes.substr(begin, end - begin);
    begin = end + 1;
    ++line_number;
    std::size_t column = 0;
    for (std::size_t field = 0; field <= line.size(); ++column) {
      const std::size_t field_end = std::min(line.find(',', field), line.size());
      const std::string text = line.substr(field, field_end - field);
      field = field_end + 1;
      if (line_number == 1) {
        if (column > 0) history.names.push_back(text);
        continue;
      }
      double value = 0;
      if (column > history.names.size() || text.empty() ||
          parse_number(text.data(), text.data() + text.size(), value) == nullptr || !std::isfinite(value))
        throw InputError(file, line_number,
                         fmt::format("\"{}\" is no counter's value; replay the drive again", text));
      (column == 0 ? history.time_s : history.values[column - 1]).push_back(value);
    }
    if (column != history.names.size() + 1)
      throw InputError(file, line_number, "has fewer columns than the first line; replay the drive again");
    if (line_number == 1) history.values.resize(history.names.size());
  }
  return history;
}

/// From the number in map.ply to the row of the trajectory.
class Rows {
 public:
  Rows(const ReportMap& map, fs::path ply) : ply_(std::move(ply)) {
    if (map.scans) {
      for (std::size_t i = 0; i < map.scans->rows.size(); ++i) add(map.scans->rows[i].scan, i);
    } else if (!map.trajectory.has_time) {
      for (std::size_t i = 0; i < map.trajectory.size(); ++i)
        add(static_cast<std::uint64_t>(std::llround(std::max(map.trajectory.stamps_s[i], 0.0))), i);
    } else {  // stamps are times, and nothing else names the scans: those of the file, in order
      std::set<std::uint32_t> numbers;
      (void)stream_ply_scans(ply_, [&numbers](std::span<const Point>, std::span<const std::uint32_t> scans) {
        for (std::size_t i = 0; i < scans.size(); ++i)
          if (i == 0 || scans[i] != scans[i - 1]) numbers.insert(scans[i]);
      });
      if (numbers.size() != map.trajectory.size())
        throw InputError(
            ply_, fmt::format("has points of {} scans and trajectory.tum {} poses; map the scans again",
                              numbers.size(), map.trajectory.size()));
      std::size_t row = 0;
      for (const std::uint32_t number : numbers) add(number, row++);
    }
  }

  std::uint32_t operator()(std::uint32_t number) {
    if (number == last_number_) return last_row_;
    const auto found = rows_.find(number);
    if (found == rows_.end())
      throw InputError(
          ply_, fmt::format("has points of scan {}, of which trajectory.tum has no pose; map the scans again",
                            number));
    last_number_ = number;
    return last_row_ = found->second;
  }

 private:
  void add(std::uint64_t number, std::size_t row) { rows_.emplace(number, static_cast<std::uint32_t>(row)); }

  fs::path ply_;
  std::unordered_map<std::uint64_t, std::uint32_t> rows_;
  std::uint64_t last_number_ = UINT64_MAX;
  std::uint32_t last_row_ = 0;
};

void read_points(ReportMap& map, const fs::path& ply, std::uint64_t most_points) {
  require(ply);
  constexpr float beyond_reach_m = 2000;
  Eigen::Array3f low = Eigen::Array3f::Constant(1e30F);
  Eigen::Array3f high = -low;
  for (const Pose& pose : map.trajectory.poses) {
    low = low.min(pose.translation_m.cast<float>().array());
    high = high.max(pose.translation_m.cast<float>().array());
  }
  low -= beyond_reach_m;
  high += beyond_reach_m;
  Rows rows(map, ply);
  const std::uint64_t count = ply_vertex_count(ply);
  const double fraction =
      count <= most_points ? 2 : static_cast<double>(most_points) / static_cast<double>(count);
  std::uint64_t index = 0;
  map.has_intensity = ply_has_intensity(ply);
  map.points_in_file = stream_ply_pieces(ply, [&](const PlyPiece& piece) {
    const auto& [points, scans, intensity] = piece;
    if (scans.empty())
      throw InputError(ply, "its points do not say which scan they come from; map the scans again");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point& p = points[i];
      const std::uint32_t row = rows(scans[i]);
      const bool is_kept = is_chosen(index++, fraction);
      if (!is_finite(p)) {
        ++map.not_finite;
      } else if (const Eigen::Array3f at(p.x, p.y, p.z); (at < low).any() || (at > high).any()) {
        ++map.far_off;
      } else if (is_kept) {
        map.points.push_back({p, row, map.has_intensity ? intensity[i] : std::uint8_t{0}});
      }
    }
  });
}

}  // namespace

ReportMap read_report_map(const fs::path& folder, std::uint64_t most_points) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw InputError(folder, "is no map folder; give one that alces map or alces replay wrote");
  require(folder / "trajectory.tum");
  ReportMap map;
  map.trajectory = read_trajectory(folder / "trajectory.tum");
  const std::size_t scans = map.trajectory.size();
  map.run = read_run(folder / "run.json", scans);
  if (const fs::path file = folder / "trajectory_without_loops.tum"; fs::exists(file, ignored)) {
    map.without_loops = read_trajectory(file);
    if (map.without_loops->size() != scans)
      throw InputError(file, fmt::format("has {} poses and trajectory.tum {}; map the scans again",
                                         map.without_loops->size(), scans));
  }
  if (const fs::path file = folder / "scans.csv"; fs::exists(file, ignored)) {
    map.scans = read_scan_table(file);
    if (map.scans->rows.size() != scans)
      throw InputError(file, fmt::format("has {} scans and trajectory.tum {} poses; map the scans again",
                                         map.scans->rows.size(), scans));
  }
  if (const fs::path file = folder / "counters.csv"; fs::exists(file, ignored))
    map.counters = read_counters(file);
  read_points(map, folder / "map.ply", most_points);
  return map;
}

}  // namespace alces::offline
