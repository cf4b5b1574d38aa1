// alces report: what becomes of map folders, whole and broken.
#include "offline/report/report.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "offline/io/files/error.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/map_folder/scan_table.h"
#include "run_alces.h"
#include "temporary_folder.h"

namespace alces::offline {
namespace {

/// Reports need the page; a program that was built without npm has none.
bool has_page() {
  if (page_problem().empty()) return true;
  WARN("skipped: " << page_problem());
  return false;
}

constexpr std::size_t scan_count = 12;

/// A drive along a wall; `points_a_scan` points each.
void write_map(const std::filesystem::path& folder, int points_a_scan, const nlohmann::json& loops) {
  Trajectory trajectory;
  PlyMapWriter writer(folder / "map.ply");
  std::uint32_t state = 1;
  const auto uniform = [&state] {
    state = state * 1664525U + 1013904223U;
    return static_cast<float>(state >> 8) / 16777216.0F;
  };
  ScanTable table;
  for (std::uint32_t i = 0; i < scan_count; ++i) {
    trajectory.stamps_s.push_back(i);
    trajectory.poses.push_back({Eigen::Quaterniond::Identity(), {i * 2.0, 0, 0}});
    std::vector<Point> points;
    for (int n = 0; n < points_a_scan; ++n)
      points.push_back({40 * uniform() - 20, n % 2 == 0 ? 5 + 0.02F * uniform() : 30 * uniform() - 15,
                        n % 2 == 0 ? 6 * uniform() : 0.02F * uniform()});
    writer.add(points, trajectory.poses.back(), i);
    table.rows.push_back(
        {i, 0, static_cast<std::uint32_t>(points_a_scan), 5, 100, 0.9, 0.02, false, {1, 2, 3, 0, 0, 0}});
  }
  writer.finish();
  write_tum(folder / "trajectory.tum", trajectory);
  write_scan_table(folder / "scans.csv", table);
  std::ofstream(folder / "run.json") << nlohmann::json{{"loops", loops}, {"scans", scan_count}};
}

nlohmann::json loop(int first, int last, bool accepted) {
  return {{"first", first},
          {"last", last},
          {"accepted", accepted},
          {"reason", accepted ? "closed" : "refused: </script>"}};
}

std::string sentence_of(const TemporaryFolder& folder) {
  try {
    (void)write_report(folder.path(), folder / "out.html");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a report is one file that holds the points and the loops, and no reference to elsewhere") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 500, {loop(0, 9, true), loop(1, 10, false)});
  const ReportSummary summary = write_report(folder.path(), folder / "out.html");
  CHECK(summary.points == scan_count * 500);
  CHECK(summary.points_shown == summary.points);
  CHECK(summary.loops_closed == 1);
  CHECK(summary.loops_refused == 1);
  const std::string html = content_of(folder / "out.html");
  CHECK(html.size() == summary.file_bytes);
  CHECK(contains(html, "id=\"cloud-0\""));
  CHECK(contains(html, "refused: \\u003c/script>"));
  CHECK_FALSE(contains(html, "<!--alces:"));
  CHECK_FALSE(contains(html, "src=\"http"));
  CHECK_FALSE(contains(html, "href=\"http"));
  CHECK_FALSE(std::filesystem::exists(folder / "out.html.part"));
}

TEST_CASE("a cloud that is too large for the limit is thinned to it") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 20'000, nlohmann::json::array());
  ReportSettings settings;
  settings.limit_bytes = 1'500'000;
  const ReportSummary summary = write_report(folder.path(), folder / "out.html", settings);
  CHECK(std::filesystem::file_size(folder / "out.html") == summary.file_bytes);
  CHECK(summary.file_bytes <= settings.limit_bytes);
  CHECK(summary.file_bytes > settings.limit_bytes * 8 / 10);
  CHECK(summary.points_shown < summary.points);
  CHECK(summary.points_shown > 40'000);
  settings.full = true;
  CHECK(write_report(folder.path(), folder / "full.html", settings).points_shown == summary.points);
}

TEST_CASE(
    "by default a report keeps to 25 MB and 12 million points, of more points it takes an even choice") {
  ReportSettings settings;
  CHECK(settings.limit_bytes == 25'000'000);
  CHECK(settings.most_points == 12'000'000);
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 1'000, nlohmann::json::array());
  settings.most_points = 3'000;
  const ReportSummary summary = write_report(folder.path(), folder / "out.html", settings);
  CHECK(summary.points == 12'000);
  CHECK(summary.points_shown <= settings.most_points);
  CHECK(summary.points_shown >= settings.most_points * 99 / 100);
  CHECK(summary.file_bytes <= settings.limit_bytes);
  settings.full = true;
  CHECK(write_report(folder.path(), folder / "full.html", settings).points_shown == 12'000);
}

TEST_CASE("of 13 million points as many are taken as 25 MB hold", "[.][slow]") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 1'080'000, nlohmann::json::array());
  const ReportSummary summary = write_report(folder.path(), folder / "out.html");
  CHECK(summary.points == 12'960'000);
  CHECK(summary.points_shown < summary.points);
  CHECK(summary.file_bytes <= 25'000'000);
  CHECK(summary.file_bytes > 22'000'000);
}

TEST_CASE("a limit that leaves no room for points is a capacity") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 100, nlohmann::json::array());
  ReportSettings settings;
  settings.limit_bytes = 100'000;
  CHECK_THROWS_AS(write_report(folder.path(), folder / "out.html", settings), CapacityError);
  CHECK_FALSE(std::filesystem::exists(folder / "out.html"));
  CHECK_FALSE(std::filesystem::exists(folder / "out.html.part"));
}

TEST_CASE("points that are not finite or far off are left out and counted") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 200, nlohmann::json::array());
  std::string ply = content_of(folder / "map.ply");
  const std::size_t body = ply.size() - scan_count * 200 * 16;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float far_off_m = 1e30F;
  std::memcpy(ply.data() + body, &nan, 4);
  std::memcpy(ply.data() + body + 16, &far_off_m, 4);
  folder.write("map.ply", ply);
  const ReportSummary summary = write_report(folder.path(), folder / "out.html");
  CHECK(summary.not_finite == 1);
  CHECK(summary.far_off == 1);
  CHECK(summary.points_shown == scan_count * 200 - 2);
}

TEST_CASE("what is missing or broken in a map folder is said in a sentence, and nothing is left behind") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  const auto fresh = [&folder] { write_map(folder.path(), 50, nlohmann::json::array({loop(0, 9, true)})); };
  for (const char* name : {"trajectory.tum", "run.json", "map.ply"}) {
    fresh();
    std::filesystem::remove(folder / name);
    CHECK_THAT(sentence_of(folder), Catch::Contains(name) && Catch::Contains("is missing"));
  }
  fresh();
  folder.write("run.json", "{\"loops\": [");
  CHECK_THAT(sentence_of(folder), Catch::Contains("run.json: is no JSON object"));
  fresh();
  folder.write("run.json", R"({"loops": [{"first": 3, "last": 12}]})");
  CHECK_THAT(sentence_of(folder), Catch::Contains("loop 0 names no scan below 12 as \"last\""));
  fresh();
  const std::string ply = content_of(folder / "map.ply");
  folder.write("map.ply", ply.substr(0, ply.size() - 7));
  CHECK_THAT(sentence_of(folder), Catch::Contains("map.ply: ends before its 600 vertices"));
  folder.write("map.ply", ply.substr(0, 40));
  CHECK_THAT(sentence_of(folder), Catch::Contains("map.ply"));
  folder.write("map.ply", "");
  CHECK_THAT(sentence_of(folder), Catch::Contains("map.ply"));
  fresh();
  const std::string table = content_of(folder / "scans.csv");
  folder.write("scans.csv", table.substr(0, table.size() - 4));
  CHECK_THAT(sentence_of(folder), Catch::Contains("scans.csv:13"));
  folder.write("scans.csv", table.substr(0, table.rfind('\n', table.size() - 2) + 1));
  CHECK_THAT(sentence_of(folder), Catch::Contains("has 11 scans and trajectory.tum 12 poses"));
  fresh();
  folder.write("trajectory_without_loops.tum", "0 0 0 0 0 0 0 1\n");
  CHECK_THAT(sentence_of(folder), Catch::Contains("has 1 poses and trajectory.tum 12"));
  std::filesystem::remove(folder / "trajectory_without_loops.tum");
  folder.write("counters.csv", "time_s,gps.fixes\n0,1\n1\n");
  CHECK_THAT(sentence_of(folder), Catch::Contains("counters.csv:3"));
  CHECK_FALSE(std::filesystem::exists(folder / "out.html"));
  CHECK_FALSE(std::filesystem::exists(folder / "out.html.part"));
}

TEST_CASE("a folder of tables and pictures is shown as the comparison") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 50, nlohmann::json::array());
  folder.write("compared/table1.csv", "method,\"error, m\"\nELCH,0.6\n\"a \"\"b\"\"\",1\n");
  folder.write("compared/fig10.svg", "<svg/>");
  ReportSettings settings;
  settings.comparison = folder / "compared";
  (void)write_report(folder.path(), folder / "out.html", settings);
  const std::string html = content_of(folder / "out.html");
  CHECK(contains(html, R"("columns":["method","error, m"])"));
  CHECK(contains(html, R"("a \"b\"")"));
  CHECK(contains(html,
                 "data:image/svg+xml;base64,"
                 "PHN2Zy8+"));
  std::filesystem::create_directory(folder / "empty");
  settings.comparison = folder / "empty";
  CHECK_THROWS_AS(write_report(folder.path(), folder / "out.html", settings), InputError);
}

TEST_CASE("the report verb: a full disk, a folder that is none, options that exclude each other") {
  if (!has_page()) return;
  const TemporaryFolder folder;
  write_map(folder.path(), 50, nlohmann::json::array());
  ProgramOutcome outcome = run_alces(folder, "report . --out town.html");
  CHECK(outcome.status == 0);
  CHECK(contains(outcome.out, "600 of 600 points"));
  outcome = run_alces(folder, "report . --out /dev/full");
  CHECK(outcome.status == 5);
  CHECK(is_one_sentence(outcome.err));
  CHECK(contains(outcome.err, "disk is full"));
  outcome = run_alces(folder, "report nowhere --out a.html");
  CHECK(outcome.status == 3);
  CHECK(is_one_sentence(outcome.err));
  CHECK(run_alces(folder, "report . --out a.html --full --limit 3MB").status == 2);
  outcome = run_alces(folder, "report . --out town.pdf");
  CHECK(outcome.status == 2);
  CHECK(contains(outcome.err, ".html"));
  CHECK_FALSE(std::filesystem::exists(folder / "town.pdf"));
  CHECK(run_alces(folder, "report . --out titled.html --title 'Our <town>'").status == 0);
  CHECK(contains(content_of(folder / "titled.html"), "<title>Our &lt;town&gt;"));
  CHECK(run_alces(folder, "report . --out a.html --limit much").status == 2);
}

TEST_CASE("scans.csv is read as it was written") {
  const TemporaryFolder folder;
  ScanTable table;
  table.has_time = true;
  table.rows.push_back(
      {7, 103.5, 11503, 6, 1492, 0.971354, 0.0132808, true, {6.04, 15.582, 0.001224, 0.5, 12, 0.25}});
  table.rows.push_back({8, 104.7, 11488, 9, 1400, 0.9, 0.02, false, {1, 2, 3, 4, 5, 6}});
  table.rows[1].surfaces = 1207;
  table.rows[1].held = {0.02, 0.25, 0.5, 0.125, 0.375, 0.0625};
  write_scan_table(folder / "scans.csv", table);
  const ScanTable read = read_scan_table(folder / "scans.csv");
  REQUIRE(read.rows.size() == 2);
  CHECK(read.has_time);
  CHECK(read.rows[0].scan == 7);
  CHECK(read.rows[0].stamp_s == Approx(103.5));
  CHECK(read.rows[0].is_predicted);
  CHECK(read.rows[0].rms_m == Approx(0.0132808));
  CHECK(read.rows[1].stage_ms == table.rows[1].stage_ms);
  CHECK(read.has_held);
  CHECK(read.rows[0].surfaces == 0);
  CHECK(read.rows[1].surfaces == 1207);
  CHECK(read.rows[1].held == table.rows[1].held);
  table.has_time = false;
  write_scan_table(folder / "scans.csv", table);
  CHECK_FALSE(read_scan_table(folder / "scans.csv").has_time);
  folder.write("scans.csv", "");
  CHECK_THROWS_AS(read_scan_table(folder / "scans.csv"), InputError);
  folder.write("scans.csv", "a,b\n1,2\n");
  CHECK_THROWS_AS(read_scan_table(folder / "scans.csv"), InputError);
}

}  // namespace alces::offline
