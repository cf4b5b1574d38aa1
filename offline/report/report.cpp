#include "report.h"
#include "offline/io/files/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>
#include <vector>

#include "cloud_encoding.h"
#include "cloud_octree.h"
#include "comparison.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"
#include "packed_bytes.h"
#include "page.h"
#include "report_map.h"
#include "static_map.h"

namespace alces::offline {
namespace {

using Json = nlohmann::json;
static_assert(std::endian::native == std::endian::little, "the page reads numbers as they lie in memory");

constexpr std::size_t least_bytes_of_points = 200'000;

std::string escaped(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

/// Inside <script type="application/json">: ASCII alone, and nothing that could end the element.
std::string script_json(const Json& json) {
  const std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

std::string block(std::string_view id, std::string_view text) {
  return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, text);
}

/// Float32, column behind column.
class TableColumns {
 public:
  template <typename Items, typename Value>
  void add(const char* name, const Items& items, Value value) {
    names_.push_back(name);
    for (const auto& item : items) numbers_.push_back(static_cast<float>(value(item)));
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] std::string text() const {
    std::vector<std::uint8_t> bytes(numbers_.size() * sizeof(float));
    if (!bytes.empty()) std::memcpy(bytes.data(), numbers_.data(), bytes.size());
    return base64(deflate_bytes(bytes));
  }

 private:
  std::vector<std::string> names_;
  std::vector<float> numbers_;
};

TableColumns scan_columns(const ReportMap& map) {
  TableColumns columns;
  const double first_s = map.trajectory.stamps_s.front();
  // Scan numbers as they are; times since the first scan, so that 32 bits are enough.
  columns.add("stamp", map.trajectory.stamps_s,
              [&](double stamp_s) { return map.trajectory.has_time ? stamp_s - first_s : stamp_s; });
  const auto add_poses = [&columns](const std::array<const char*, 7>& names, const std::vector<Pose>& poses) {
    for (std::size_t i = 0; i < 3; ++i)
      columns.add(names.at(i), poses,
                  [i](const Pose& pose) { return pose.translation_m(static_cast<Eigen::Index>(i)); });
    for (std::size_t i = 0; i < 4; ++i)  // Eigen's order: x, y, z, w
      columns.add(names.at(3 + i), poses,
                  [i](const Pose& pose) { return pose.rotation.coeffs()(static_cast<Eigen::Index>(i)); });
  };
  add_poses({"x", "y", "z", "qx", "qy", "qz", "qw"}, map.trajectory.poses);
  if (map.without_loops)
    add_poses({"before_x", "before_y", "before_z", "before_qx", "before_qy", "before_qz", "before_qw"},
              map.without_loops->poses);
  if (!map.scans) return columns;
  const std::vector<ScanRow>& rows = map.scans->rows;
  columns.add("scan", rows, [](const ScanRow& row) { return row.scan; });
  columns.add("points", rows, [](const ScanRow& row) { return row.points; });
  columns.add("iterations", rows, [](const ScanRow& row) { return row.iterations; });
  columns.add("correspondences", rows, [](const ScanRow& row) { return row.correspondences; });
  columns.add("overlap", rows, [](const ScanRow& row) { return row.overlap; });
  columns.add("rms_m", rows, [](const ScanRow& row) { return row.rms_m; });
  columns.add("is_predicted", rows, [](const ScanRow& row) { return row.is_predicted ? 1 : 0; });
  if (map.scans->has_held) {
    columns.add("surfaces", rows, [](const ScanRow& row) { return row.surfaces; });
    constexpr std::array<const char*, direction_names.size()> held_names = {
        "held_x", "held_y", "held_z", "held_roll", "held_pitch", "held_yaw"};
    for (std::size_t i = 0; i < held_names.size(); ++i)
      columns.add(held_names.at(i), rows, [i](const ScanRow& row) { return row.held.at(i); });
  }
  constexpr std::array<const char*, stage_names.size()> names = {
      "reduce_ms", "store_ms", "match_ms", "detect_ms", "loop_match_ms", "loop_share_out_ms"};
  for (std::size_t i = 0; i < names.size(); ++i)
    columns.add(names.at(i), rows, [i](const ScanRow& row) { return row.stage_ms.at(i); });
  return columns;
}

/// level, x, y, z, points of every node, one behind the other.
Json node_table(std::span<const CloudNode> nodes) {
  Json table = Json::array();
  for (const CloudNode& node : nodes)
    for (const std::size_t number : {std::size_t{node.level}, std::size_t{node.cell[0]},
                                     std::size_t{node.cell[1]}, std::size_t{node.cell[2]}, node.count})
      table.push_back(number);
  return table;
}

}  // namespace

ReportSummary write_report(const std::filesystem::path& map_folder, const std::filesystem::path& html,
                           const ReportSettings& settings, const std::function<void(const char*)>& progress) {
  const auto say = [&progress](const char* stage) {
    if (progress) progress(stage);
  };
  const std::vector<PagePiece> page = page_pieces();
  OutputFile output(html);  // a folder that cannot be written is found out before the work
  say("reading the map");
  ReportMap map = read_report_map(
      map_folder, settings.full ? std::numeric_limits<std::uint64_t>::max() : settings.most_points);
  ReportSummary summary;
  summary.points = map.points_in_file;
  summary.not_finite = map.not_finite;
  summary.far_off = map.far_off;
  for (const Json& loop : map.run["loops"])
    ++(loop.contains("accepted") && loop["accepted"] == true ? summary.loops_closed : summary.loops_refused);

  say("drawing it from above");
  const std::string title = settings.title.empty()
                                ? std::filesystem::weakly_canonical(map_folder).filename().string()
                                : settings.title;
  const std::string static_map = static_map_svg(map);
  const TableColumns columns = scan_columns(map);
  const std::string scans_block = block("scans", columns.text());

  Json report;
  report["title"] = title;
  report["scans"] = map.trajectory.size();
  report["has_time"] = map.trajectory.has_time;
  if (map.trajectory.has_time) report["first_stamp_s"] = map.trajectory.stamps_s.front();
  report["columns"] = columns.names();
  report["run"] = std::move(map.run);
  if (map.counters)
    report["counters"] = {
        {"names", map.counters->names}, {"time_s", map.counters->time_s}, {"values", map.counters->values}};
  if (settings.comparison) report["comparison"] = read_comparison(*settings.comparison);

  say("sorting its points");
  const CloudOctree tree = build_cloud_octree(std::exchange(map.points, {}));
  std::size_t budget_bytes = std::numeric_limits<std::size_t>::max();
  if (!settings.full) {
    // What is not yet there of the page: the table of nodes and chunks, and the elements about the chunks.
    const std::size_t to_come =
        json_text(node_table(tree.nodes), -1).size() + 200 * (16 + tree.points.size() / 100'000) + 2000;
    std::size_t rest = static_map.size() + scans_block.size() + script_json(report).size() + to_come;
    for (const PagePiece& piece : page) rest += piece.text.size() + 6 * title.size();
    if (rest + least_bytes_of_points > settings.limit_bytes)
      throw CapacityError(fmt::format(
          "{}: all but the points takes {}, and the limit is {}; give a higher --limit, or --full",
          html.string(), format_byte_size(rest), format_byte_size(settings.limit_bytes)));
    budget_bytes = settings.limit_bytes - rest;
  }
  say("packing them");
  const EncodedCloud cloud =
      encode_cloud(tree, map.trajectory.size(), settings.full ? settings.full_step_m : settings.step_m,
                   budget_bytes, map.has_intensity);
  summary.points_shown = cloud.points;
  Json chunks = Json::array();
  for (const EncodedChunk& chunk : cloud.chunks) chunks.push_back({chunk.nodes, chunk.points});
  report["cloud"] = {{"origin_m", {tree.origin_m.x(), tree.origin_m.y(), tree.origin_m.z()}},
                     {"side_m", tree.side_m},
                     {"step_m", cloud.step_m},
                     {"cells_a_side", CloudOctree::cells_a_side},
                     {"scans_a_number", cloud.scans_a_number},
                     {"has_intensity", cloud.has_intensity},
                     {"points", summary.points},
                     {"points_shown", cloud.points},
                     {"points_left_out", summary.not_finite + summary.far_off},
                     {"nodes", node_table(cloud.nodes)},
                     {"chunks", std::move(chunks)}};

  say("writing the page");
  const auto write = [&](std::string_view text) {
    output.write(text);
    summary.file_bytes += text.size();
  };
  for (const PagePiece& piece : page) {
    write(piece.text);
    if (piece.mark == "title") write(escaped(title));
    if (piece.mark == "static-map") write(static_map);
    if (piece.mark != "data") continue;
    write(fmt::format("<script type=\"application/json\" id=\"report\">{}</script>\n", script_json(report)));
    write(scans_block);
    for (std::size_t i = 0; i < cloud.chunks.size(); ++i)
      write(block(fmt::format("cloud-{}", i), cloud.chunks[i].text));
  }
  output.commit();
  return summary;
}

}  // namespace alces::offline
